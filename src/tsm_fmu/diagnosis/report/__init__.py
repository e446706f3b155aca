"""The answer as a sentence, page and files."""
