// SPDX-License-Identifier: Apache-2.0
// Linear on oneDNN's matmul. One primitive per (shape, types, strides, number of rows), shared by
// all layers of the process; each is created for, and run by, one thread.
#include "vggtcd/nn/linear.h"

#include <array>
#include <dnnl.hpp>
#include <map>
#include <mutex>
#include <unordered_map>

#include "vggtcd/core/cpu_features.h"

// oneDNN as Debian builds it runs on libgomp. Its whole interface here is this pair.
extern "C" int omp_get_max_threads(void);
extern "C" void omp_set_num_threads(int count);

namespace vggtcd {
namespace {

using Tag = dnnl::memory::format_tag;

// oneDNN asks OpenMP how many threads there are, when a primitive is created and when it runs.
// While this object lives the calling thread answers: one.
class OneThread {
 public:
  OneThread() : before_(omp_get_max_threads()) { omp_set_num_threads(1); }
  ~OneThread() { omp_set_num_threads(before_); }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;

 private:
  int before_;
};

// VGGTCD_ISA below what the processor has holds for oneDNN too.
void limit_isa() {
  if (cpu_level() == detected_cpu_level()) return;
  switch (cpu_level()) {
    case CpuLevel::kReference:
      dnnl::set_max_cpu_isa(dnnl::cpu_isa::sse41);
      break;
    case CpuLevel::kAvx2:
      dnnl::set_max_cpu_isa(dnnl::cpu_isa::avx2);
      break;
    case CpuLevel::kAvx512:
      dnnl::set_max_cpu_isa(dnnl::cpu_isa::avx512_core);
      break;
    case CpuLevel::kAvx512Bf16:
      dnnl::set_max_cpu_isa(dnnl::cpu_isa::avx512_core_bf16);
      break;
  }
}

const dnnl::engine& engine() {
  static const dnnl::engine cpu = [] {
    limit_isa();
    return dnnl::engine(dnnl::engine::kind::cpu, 0);
  }();
  return cpu;
}

dnnl::memory::data_type onednn_type(DType dtype) {
  return dtype == DType::kF32 ? dnnl::memory::data_type::f32 : dnnl::memory::data_type::bf16;
}

// All that a primitive depends on.
struct Key {
  int64_t rows, in, out, x_stride, y_stride;
  DType compute, output;
  Activation activation;
  bool bias, gamma, accumulate;
  auto operator<=>(const Key&) const = default;
};

dnnl::memory::desc bias_desc(int64_t out) {
  return {{1, out}, dnnl::memory::data_type::f32, Tag::ab};
}

dnnl::matmul::primitive_desc make_desc(const Key& key, const dnnl::memory::desc& weights) {
  const dnnl::memory::desc x({key.rows, key.in}, onednn_type(key.compute),
                             dnnl::memory::dims{key.x_stride, 1});
  const dnnl::memory::desc y({key.rows, key.out}, onednn_type(key.output),
                             dnnl::memory::dims{key.y_stride, 1});
  dnnl::post_ops after;
  if (key.activation == Activation::kGelu) {
    after.append_eltwise(1.0f, dnnl::algorithm::eltwise_gelu_erf, 0.0f, 0.0f);
  } else if (key.activation == Activation::kRelu) {
    after.append_eltwise(1.0f, dnnl::algorithm::eltwise_relu, 0.0f, 0.0f);
  }
  if (key.gamma) after.append_binary(dnnl::algorithm::binary_mul, bias_desc(key.out));
  if (key.accumulate) after.append_sum(1.0f);
  dnnl::primitive_attr attr;
  attr.set_post_ops(after);
  attr.set_scratchpad_mode(dnnl::scratchpad_mode::user);
  if (key.bias) return {{x, weights, bias_desc(key.out), y}, attr, engine()};
  return {{x, weights, y}, attr, engine()};
}

struct Kernel {
  dnnl::matmul::primitive_desc desc;
  dnnl::matmul matmul;
};

// The kernel for this key that reads weights in the given layout.
std::shared_ptr<const Kernel> kernel(const Key& key, const dnnl::memory::desc& weights) {
  static std::mutex mutex;
  static std::map<Key, std::shared_ptr<const Kernel>> kernels;
  const std::lock_guard lock(mutex);
  std::shared_ptr<const Kernel>& entry = kernels[key];
  if (!entry) {
    const auto desc = make_desc(key, weights);
    entry = std::make_shared<Kernel>(Kernel{desc, dnnl::matmul(desc)});
  }
  return entry;
}

// oneDNN's own working memory, one per thread, grown to the largest need.
std::byte* scratchpad(size_t bytes) {
  thread_local Buffer buffer;
  buffer.reserve(bytes);
  return buffer.data();
}

}  // namespace

struct Linear::Impl {
  Key key;  // rows and strides are those of the call
  std::vector<float> bias, gamma;
  Buffer packed;
  dnnl::memory::desc packed_desc;

  Impl(int64_t in, int64_t out, std::vector<float> bias_values, LinearOptions options)
      : bias(std::move(bias_values)), gamma(std::move(options.gamma)) {
    check(gamma.empty() || std::ssize(gamma) == out, "linear: one gamma per output channel");
    check(bias.empty() || std::ssize(bias) == out, "linear: one bias per output channel");
    const bool accumulate = options.accumulate || !gamma.empty();
    check(!accumulate || options.output == DType::kF32, "linear: only f32 is accumulated");
    key = {kRowBlock,
           in,
           out,
           in,
           out,
           options.compute,
           options.output,
           options.activation,
           !bias.empty(),
           !gamma.empty(),
           accumulate};
  }

  // Packs weight [out, in] of f32 or bf16 in the layout that the product of a full block wants.
  void pack(DType dtype, const std::byte* weight) {
    const OneThread one_thread;
    const dnnl::memory::dims shape{key.in, key.out};
    packed_desc = make_desc(key, dnnl::memory::desc(shape, onednn_type(key.compute), Tag::any))
                      .weights_desc();
    packed.reserve(packed_desc.get_size());
    dnnl::memory source({shape, onednn_type(dtype), Tag::ba}, engine(),
                        const_cast<std::byte*>(weight));
    dnnl::memory target(packed_desc, engine(), packed.data());
    dnnl::stream stream(engine());
    dnnl::reorder(source, target).execute(stream, source, target);
    stream.wait();
  }
};

Linear::Linear(const WeightScope& scope, int64_t in, int64_t out, LinearOptions options,
               bool has_bias) {
  const TensorView weight = scope.take("weight", {out, in});
  impl_ = std::make_unique<Impl>(
      in, out, has_bias ? scope.take_f32("bias", {out}) : std::vector<float>{}, std::move(options));
  if (weight.dtype == DType::kF32 || weight.dtype == DType::kBF16) {
    impl_->pack(weight.dtype, weight.data.data());
  } else {
    std::vector<float> values(static_cast<size_t>(weight.numel()));
    convert_to_float(weight.dtype, weight.data.data(), values.data(), weight.numel());
    impl_->pack(DType::kF32, reinterpret_cast<const std::byte*>(values.data()));
  }
  scope.release(weight);
}

Linear::Linear(std::span<const float> weight, std::span<const float> bias, int64_t in, int64_t out,
               LinearOptions options)
    : impl_(std::make_unique<Impl>(in, out, std::vector<float>(bias.begin(), bias.end()),
                                   std::move(options))) {
  check(std::ssize(weight) == in * out, "linear: weight is [out, in]");
  impl_->pack(DType::kF32, reinterpret_cast<const std::byte*>(weight.data()));
}

Linear::~Linear() = default;
Linear::Linear(Linear&&) noexcept = default;
Linear& Linear::operator=(Linear&&) noexcept = default;

int64_t Linear::in() const { return impl_->key.in; }
int64_t Linear::out() const { return impl_->key.out; }
DType Linear::compute() const { return impl_->key.compute; }
size_t Linear::packed_bytes() const { return impl_->packed.size(); }

void Linear::run(int64_t rows, const Rows& x, const Rows& y) const {
  check(rows >= 1 && rows <= kRowBlock, "linear: 1 to kRowBlock rows per call");
  check(x.dtype == impl_->key.compute && y.dtype == impl_->key.output, "linear: types of x and y");
  const OneThread one_thread;
  Key key = impl_->key;
  key.rows = rows;
  key.x_stride = x.stride;
  key.y_stride = y.stride;
  const std::shared_ptr<const Kernel> matmul = kernel(key, impl_->packed_desc);
  const auto memory = [](const dnnl::memory::desc& desc, const void* data) {
    return dnnl::memory(desc, engine(), const_cast<void*>(data));
  };
  const dnnl::matmul::primitive_desc& desc = matmul->desc;
  std::unordered_map<int, dnnl::memory> arguments{
      {DNNL_ARG_SRC, memory(desc.src_desc(), x.data)},
      {DNNL_ARG_WEIGHTS, memory(desc.weights_desc(), impl_->packed.data())},
      {DNNL_ARG_DST, memory(desc.dst_desc(), y.data)},
      {DNNL_ARG_SCRATCHPAD,
       memory(desc.scratchpad_desc(), scratchpad(desc.scratchpad_desc().get_size()))}};
  if (key.bias) {
    arguments.emplace(DNNL_ARG_BIAS, memory(bias_desc(key.out), impl_->bias.data()));
  }
  if (key.gamma) {
    arguments.emplace(DNNL_ARG_ATTR_MULTIPLE_POST_OP(0) | DNNL_ARG_SRC_1,
                      memory(bias_desc(key.out), impl_->gamma.data()));
  }
  dnnl::stream stream(engine());
  matmul->matmul.execute(stream, arguments);
  stream.wait();
}

bool bf16_is_fast() { return cpu_level() == CpuLevel::kAvx512Bf16; }

}  // namespace vggtcd
