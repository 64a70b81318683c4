// SPDX-License-Identifier: Apache-2.0
// CpuLevel: which of a kernel's variants this process runs. The baseline build is plain x86-64; a
// kernel that has variants for larger instruction sets chooses among them here, at run time.
#pragma once

#include <span>
#include <string_view>

#include "vggtcd/core/options.h"

namespace vggtcd {

// Each level includes the ones before it; the flags behind them are in vggtcd_isa (cmake/).
enum class CpuLevel {
  kReference,  // plain C++, whatever the compiler makes of it
  kAvx2,       // AVX2, FMA, F16C
  kAvx512,     // and AVX-512 F, BW, DQ, VL
  kAvx512Bf16  // and AVX512_BF16
};

std::span<const EnumName<CpuLevel>> enum_names(CpuLevel);

// The highest level that this processor and its operating system support.
CpuLevel detected_cpu_level();

// The level to run: the detected one, unless the environment variable VGGTCD_ISA (reference, avx2,
// avx512 or avx512bf16) asks for a lower one. Throws Error{kUsage} if it asks for something else.
CpuLevel cpu_level();

// For tests: while it lives, cpu_level() is this level, on all threads. Asking for more than the
// processor has is Error{kInternal}.
class ScopedCpuLevel {
 public:
  explicit ScopedCpuLevel(CpuLevel level);
  ~ScopedCpuLevel();
  ScopedCpuLevel(const ScopedCpuLevel&) = delete;
  ScopedCpuLevel& operator=(const ScopedCpuLevel&) = delete;

 private:
  int previous_;
};

}  // namespace vggtcd
