"""Loads and motion that a task requires of every joint."""
