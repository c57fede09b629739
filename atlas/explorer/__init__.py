"""One page that explores a scene in a browser, with no installation: what is in it, and the page itself."""
