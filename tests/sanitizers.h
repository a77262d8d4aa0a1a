/* Tells for every compiler which sanitizers the tests are built with. */
#ifndef TEST_SANITIZERS_H
#define TEST_SANITIZERS_H

#ifdef __has_feature
#define TEST_HAS_FEATURE(name) __has_feature(name)
#else
#define TEST_HAS_FEATURE(name) 0
#endif

#if defined(__SANITIZE_ADDRESS__) || TEST_HAS_FEATURE(address_sanitizer)
#define TEST_ADDRESS_SANITIZER 1
#else
#define TEST_ADDRESS_SANITIZER 0
#endif

#if defined(__SANITIZE_THREAD__) || TEST_HAS_FEATURE(thread_sanitizer)
#define TEST_THREAD_SANITIZER 1
#else
#define TEST_THREAD_SANITIZER 0
#endif

/* Sanitizers make tests several times slower. If TEST_BY_TURNS is 1, a test may vary its parameters
 * one after the other, and need not try all combinations. */
#define TEST_BY_TURNS (TEST_ADDRESS_SANITIZER || TEST_THREAD_SANITIZER)

#endif
