# make -f @stem@.mk test
CFLAGS = -std=c99 -O2 -Wall -Wextra

test: @stem@_test
	./@stem@_test

@stem@_test: @stem@_test.c @stem@.c @stem@.h
	$(CC) $(CFLAGS) -o $@ @stem@_test.c @stem@.c -lm

clean:
	rm -f @stem@_test

.PHONY: test clean
