// server/import/sanitized.h - whether AddressSanitizer watches this build.
// Its shadow memory reserves terabytes of addresses and its reports open files, so RLIMIT_AS is off and the system call
// filter only denies there (child/sandbox.cpp).
#pragma once

#if defined(__SANITIZE_ADDRESS__)
#define SPINALTAP_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define SPINALTAP_SANITIZED 1
#endif
#endif
#ifndef SPINALTAP_SANITIZED
#define SPINALTAP_SANITIZED 0
#endif
