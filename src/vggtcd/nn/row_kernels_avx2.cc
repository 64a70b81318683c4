// SPDX-License-Identifier: Apache-2.0
// The functions of row_kernels.h on AVX2.
#include "vggtcd/nn/row_kernels_impl.h"
#include "vggtcd/nn/simd_avx2.h"

namespace vggtcd {

const RowKernels& row_kernels_avx2() {
  static constexpr RowKernels kTable = RowOps<Avx2>::table();
  return kTable;
}

}  // namespace vggtcd
