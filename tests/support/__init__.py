"""What tests share: strategies, recordings, simulated records and small programs."""
