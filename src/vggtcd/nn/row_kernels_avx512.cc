// SPDX-License-Identifier: Apache-2.0
// The functions of row_kernels.h on AVX-512.
#include "vggtcd/nn/row_kernels_impl.h"
#include "vggtcd/nn/simd_avx512.h"

namespace vggtcd {

const RowKernels& row_kernels_avx512() {
  static constexpr RowKernels kTable = RowOps<Avx512>::table();
  return kTable;
}

}  // namespace vggtcd
