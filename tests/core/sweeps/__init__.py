"""Tests of isethdr_core.sweeps."""
