"""Error beside time: `python -m benchmarks`. Each part also runs as a test, with small sizes (test_benchmarks)."""
