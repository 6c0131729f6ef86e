"""The paper by our own means: its numbers, equations and statements, each beside what this program computes."""
