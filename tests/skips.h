/* What this machine lacks for a test is skipped, and not passed: a program one of whose tests
 * called skip() or test_lacks(), and none of which failed, ends with exit status 77, which CTest
 * shows as skipped. Linked into every test by trip_test(). */
#ifndef TEST_SKIPS_H
#define TEST_SKIPS_H

/* A part of the running test is left out, for lack of `what`; the rest of it goes on. */
void test_lacks(const char *name);

#endif
