"""The studio: a page on which a designer moves a machine and sees where it is stiff. It computes nothing itself."""
