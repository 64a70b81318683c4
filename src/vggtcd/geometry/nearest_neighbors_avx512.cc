// SPDX-License-Identifier: Apache-2.0
// The nearest-neighbour search for AVX-512: 16 floats in one register.
#include <cstdint>

#include "vggtcd/core/intrinsics.h"
#include "vggtcd/geometry/nearest_neighbors_kernel.h"

namespace vggtcd {
namespace {

struct Avx512Lanes {
  using Mask = __mmask16;
  __m512 v;

  static Avx512Lanes load(const float* aligned) { return {_mm512_load_ps(aligned)}; }
  static Avx512Lanes all(float value) { return {_mm512_set1_ps(value)}; }
  static uint32_t bits(Mask mask) { return mask; }
  static void assign(Mask where, int32_t value, int32_t* aligned) {
    _mm512_mask_store_epi32(aligned, where, _mm512_set1_epi32(value));
  }
  static Avx512Lanes with_lane(Avx512Lanes a, int lane, float value) {
    return {_mm512_mask_mov_ps(a.v, static_cast<__mmask16>(1u << lane), _mm512_set1_ps(value))};
  }
  void store(float* aligned) const { _mm512_store_ps(aligned, v); }

  friend Avx512Lanes operator+(Avx512Lanes a, Avx512Lanes b) { return {_mm512_add_ps(a.v, b.v)}; }
  friend Avx512Lanes operator-(Avx512Lanes a, Avx512Lanes b) { return {_mm512_sub_ps(a.v, b.v)}; }
  friend Avx512Lanes operator*(Avx512Lanes a, Avx512Lanes b) { return {_mm512_mul_ps(a.v, b.v)}; }
  friend Avx512Lanes min(Avx512Lanes a, Avx512Lanes b) { return {_mm512_min_ps(a.v, b.v)}; }
  friend Avx512Lanes max(Avx512Lanes a, Avx512Lanes b) { return {_mm512_max_ps(a.v, b.v)}; }
  friend Avx512Lanes sqrt(Avx512Lanes a) { return {_mm512_sqrt_ps(a.v)}; }
  friend float min_of(Avx512Lanes a) { return _mm512_reduce_min_ps(a.v); }
  friend float max_of(Avx512Lanes a) { return _mm512_reduce_max_ps(a.v); }
  friend Mask less(Avx512Lanes a, Avx512Lanes b) {
    return _mm512_cmp_ps_mask(a.v, b.v, _CMP_LT_OQ);
  }
  friend Mask less_equal(Avx512Lanes a, Avx512Lanes b) {
    return _mm512_cmp_ps_mask(a.v, b.v, _CMP_LE_OQ);
  }
  friend Mask equal(Avx512Lanes a, Avx512Lanes b) {
    return _mm512_cmp_ps_mask(a.v, b.v, _CMP_EQ_OQ);
  }
};

}  // namespace

void nearest_neighbors_avx512(const NearestNeighborTree& tree, const NearestNeighborQuery& query) {
  PacketSearch<Avx512Lanes>(tree, query).run();
}

}  // namespace vggtcd
