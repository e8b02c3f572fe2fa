/* What cannot go on is said in one line, and ends the program. */
#pragma once
#include <stdio.h>
#include <stdlib.h>

static inline _Noreturn void fail(const char *what) {
	fprintf(stderr, "board: %s\n", what);
	exit(1);
}
