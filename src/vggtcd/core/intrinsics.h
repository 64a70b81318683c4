// SPDX-License-Identifier: Apache-2.0
// The processor's intrinsics, for the files that are compiled for one instruction set.
#pragma once

// g++ 12 takes the intrinsics' own "undefined" operands for mistakes (its bug 105593).
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wuninitialized"
#if !defined(__clang__)
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <immintrin.h>
#pragma GCC diagnostic pop
