"""Results for people: figures, text tables and pages."""
