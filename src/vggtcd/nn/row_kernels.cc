// SPDX-License-Identifier: Apache-2.0
// Choice of the row kernels at run time.
#include "vggtcd/nn/row_kernels.h"

#include "vggtcd/core/cpu_features.h"

namespace vggtcd {

const RowKernels* row_kernels() {
  const CpuLevel level = cpu_level();
  if (level >= CpuLevel::kAvx512) return &row_kernels_avx512();
  return level >= CpuLevel::kAvx2 ? &row_kernels_avx2() : nullptr;
}

}  // namespace vggtcd
