"""Tests of isethdr_core.results."""
