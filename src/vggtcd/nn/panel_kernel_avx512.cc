// SPDX-License-Identifier: Apache-2.0
// The panel kernel on AVX-512.
#include "vggtcd/nn/panel_kernel_impl.h"
#include "vggtcd/nn/simd_avx512.h"

namespace vggtcd {

const PanelKernel& panel_kernel_avx512() {
  static constexpr PanelKernel kernel = PanelProductKernel<Avx512>::kernel();
  return kernel;
}

}  // namespace vggtcd
