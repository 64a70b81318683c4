// SPDX-License-Identifier: Apache-2.0
// The panel kernel on AVX2.
#include "vggtcd/nn/panel_kernel_impl.h"
#include "vggtcd/nn/simd_avx2.h"

namespace vggtcd {

const PanelKernel& panel_kernel_avx2() {
  static constexpr PanelKernel kernel = PanelProductKernel<Avx2>::kernel();
  return kernel;
}

}  // namespace vggtcd
