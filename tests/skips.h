/* Reports tests as skipped if this machine lacks something for them. If a test of a program calls
 * skip() or test_lacks() and no test fails, the program ends with exit status 77. CTest shows this
 * status as skipped. trip_test() links skips.c into every test. */
#ifndef TEST_SKIPS_H
#define TEST_SKIPS_H

/* Notes that the running test leaves out a part because this machine lacks `name`. The test
 * continues. */
void test_lacks(const char *name);

#endif
