"""The model that an estimate gives, and what follows from its numbers."""
