// SPDX-License-Identifier: Apache-2.0
// The nearest-neighbour search for AVX2: 16 floats in two registers.
#include <cstdint>

#include "vggtcd/core/intrinsics.h"
#include "vggtcd/geometry/nearest_neighbors_kernel.h"

namespace vggtcd {
namespace {

struct Avx2Lanes {
  struct Mask {
    __m256 a, b;
  };
  __m256 a, b;

  static Avx2Lanes load(const float* p) { return {_mm256_load_ps(p), _mm256_load_ps(p + 8)}; }
  static Avx2Lanes all(float value) { return {_mm256_set1_ps(value), _mm256_set1_ps(value)}; }
  static uint32_t bits(Mask mask) {
    return static_cast<uint32_t>(_mm256_movemask_ps(mask.a) | _mm256_movemask_ps(mask.b) << 8);
  }
  static void assign(Mask where, int32_t value, int32_t* p) {
    const __m256i values = _mm256_set1_epi32(value);
    _mm256_maskstore_epi32(p, _mm256_castps_si256(where.a), values);
    _mm256_maskstore_epi32(p + 8, _mm256_castps_si256(where.b), values);
  }
  static Avx2Lanes with_lane(Avx2Lanes x, int lane, float value) {
    const __m256i is_lane_a =
        _mm256_cmpeq_epi32(_mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7), _mm256_set1_epi32(lane));
    const __m256i is_lane_b = _mm256_cmpeq_epi32(_mm256_setr_epi32(8, 9, 10, 11, 12, 13, 14, 15),
                                                 _mm256_set1_epi32(lane));
    const __m256 values = _mm256_set1_ps(value);
    return {_mm256_blendv_ps(x.a, values, _mm256_castsi256_ps(is_lane_a)),
            _mm256_blendv_ps(x.b, values, _mm256_castsi256_ps(is_lane_b))};
  }
  void store(float* p) const {
    _mm256_store_ps(p, a);
    _mm256_store_ps(p + 8, b);
  }
  friend Avx2Lanes operator+(Avx2Lanes x, Avx2Lanes y) {
    return {_mm256_add_ps(x.a, y.a), _mm256_add_ps(x.b, y.b)};
  }
  friend Avx2Lanes operator-(Avx2Lanes x, Avx2Lanes y) {
    return {_mm256_sub_ps(x.a, y.a), _mm256_sub_ps(x.b, y.b)};
  }
  friend Avx2Lanes operator*(Avx2Lanes x, Avx2Lanes y) {
    return {_mm256_mul_ps(x.a, y.a), _mm256_mul_ps(x.b, y.b)};
  }
  friend Avx2Lanes min(Avx2Lanes x, Avx2Lanes y) {
    return {_mm256_min_ps(x.a, y.a), _mm256_min_ps(x.b, y.b)};
  }
  friend Avx2Lanes max(Avx2Lanes x, Avx2Lanes y) {
    return {_mm256_max_ps(x.a, y.a), _mm256_max_ps(x.b, y.b)};
  }
  friend Avx2Lanes sqrt(Avx2Lanes x) { return {_mm256_sqrt_ps(x.a), _mm256_sqrt_ps(x.b)}; }
  friend float min_of(Avx2Lanes x) {
    const __m256 eight = _mm256_min_ps(x.a, x.b);
    __m128 four = _mm_min_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    four = _mm_min_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_min_ss(four, _mm_movehdup_ps(four)));
  }
  friend float max_of(Avx2Lanes x) {
    const __m256 eight = _mm256_max_ps(x.a, x.b);
    __m128 four = _mm_max_ps(_mm256_castps256_ps128(eight), _mm256_extractf128_ps(eight, 1));
    four = _mm_max_ps(four, _mm_movehl_ps(four, four));
    return _mm_cvtss_f32(_mm_max_ss(four, _mm_movehdup_ps(four)));
  }
  friend Mask less(Avx2Lanes x, Avx2Lanes y) {
    return {_mm256_cmp_ps(x.a, y.a, _CMP_LT_OQ), _mm256_cmp_ps(x.b, y.b, _CMP_LT_OQ)};
  }
  friend Mask less_equal(Avx2Lanes x, Avx2Lanes y) {
    return {_mm256_cmp_ps(x.a, y.a, _CMP_LE_OQ), _mm256_cmp_ps(x.b, y.b, _CMP_LE_OQ)};
  }
  friend Mask equal(Avx2Lanes x, Avx2Lanes y) {
    return {_mm256_cmp_ps(x.a, y.a, _CMP_EQ_OQ), _mm256_cmp_ps(x.b, y.b, _CMP_EQ_OQ)};
  }
};

}  // namespace

void nearest_neighbors_avx2(const NearestNeighborTree& tree, const NearestNeighborQuery& query) {
  PacketSearch<Avx2Lanes>(tree, query).run();
}

}  // namespace vggtcd
