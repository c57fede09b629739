"""The source documents, reproduced: a page for each."""
