// SPDX-License-Identifier: Apache-2.0
// CpuLevel: detection by the compiler's own CPUID table (which also asks the operating system
// whether it saves the wide registers), and the two ways to lower it.
#include "vggtcd/core/cpu_features.h"

#include <cpuid.h>

#include <array>
#include <atomic>
#include <cstdlib>

#include "vggtcd/core/error.h"

namespace vggtcd {
namespace {

constexpr std::array<EnumName<CpuLevel>, 4> kNames{{{CpuLevel::kReference, "reference"},
                                                    {CpuLevel::kAvx2, "avx2"},
                                                    {CpuLevel::kAvx512, "avx512"},
                                                    {CpuLevel::kAvx512Bf16, "avx512bf16"}}};

// clang 14 does not know the name "f16c".
bool has_f16c() {
  unsigned eax = 0, ebx = 0, ecx = 0, edx = 0;
  return __get_cpuid(1, &eax, &ebx, &ecx, &edx) != 0 && (ecx & (1u << 29)) != 0;
}

CpuLevel detect() {
  __builtin_cpu_init();
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma") || !has_f16c()) {
    return CpuLevel::kReference;
  }
  if (!__builtin_cpu_supports("avx512f") || !__builtin_cpu_supports("avx512bw") ||
      !__builtin_cpu_supports("avx512dq") || !__builtin_cpu_supports("avx512vl")) {
    return CpuLevel::kAvx2;
  }
  return __builtin_cpu_supports("avx512bf16") ? CpuLevel::kAvx512Bf16 : CpuLevel::kAvx512;
}

CpuLevel level_from_environment() {
  const char* wanted = std::getenv("VGGTCD_ISA");
  if (wanted == nullptr || *wanted == '\0') return detected_cpu_level();
  for (const auto& entry : kNames) {
    if (entry.name != wanted) continue;
    if (entry.value > detected_cpu_level()) {
      throw_error(ErrorCode::kUsage,
                  "VGGTCD_ISA={}: expected at most {}, all that this processor has; unset it or "
                  "choose a lower level",
                  wanted, enum_to_string(detected_cpu_level()));
    }
    return entry.value;
  }
  throw_error(ErrorCode::kUsage,
              "VGGTCD_ISA={}: expected reference, avx2, avx512 or avx512bf16; unset it to use all "
              "that this processor has",
              wanted);
}

constexpr int kNotForced = -1;
std::atomic<int> g_forced{kNotForced};

}  // namespace

std::span<const EnumName<CpuLevel>> enum_names(CpuLevel) { return kNames; }

CpuLevel detected_cpu_level() {
  static const CpuLevel level = detect();
  return level;
}

CpuLevel cpu_level() {
  const int forced = g_forced.load(std::memory_order_relaxed);
  if (forced != kNotForced) return static_cast<CpuLevel>(forced);
  static const CpuLevel level = level_from_environment();
  return level;
}

ScopedCpuLevel::ScopedCpuLevel(CpuLevel level) {
  check(level <= detected_cpu_level(), "ScopedCpuLevel: more than this processor has");
  previous_ = g_forced.exchange(static_cast<int>(level), std::memory_order_relaxed);
}

ScopedCpuLevel::~ScopedCpuLevel() { g_forced.store(previous_, std::memory_order_relaxed); }

}  // namespace vggtcd
