"""How methods compare, where the truth is known and where it is not."""
