"""Validation: the machine rebuilt from its geometry in an independent engine, loaded, and compared with C."""
