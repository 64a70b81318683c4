// SPDX-License-Identifier: Apache-2.0
// Product on oneDNN's matmul, 2.6 and later. One primitive per (shape, types, strides, number of
// rows), shared by all layers of the process; each is created for, and run by, one thread.
#include <dnnl.hpp>
#include <map>
#include <mutex>
#include <set>
#include <unordered_map>

#include "vggtcd/core/cpu_features.h"
#include "vggtcd/nn/product.h"

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

const dnnl::engine& engine() {
  static const dnnl::engine cpu = [] {
    limit_onednn_to_cpu_level();
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

// The differences between the interfaces of oneDNN 2 and 3.
void append_eltwise(dnnl::post_ops& after, dnnl::algorithm algorithm) {
#if DNNL_VERSION_MAJOR >= 3
  after.append_eltwise(algorithm, 0.0f, 0.0f);
#else
  after.append_eltwise(1.0f, algorithm, 0.0f, 0.0f);
#endif
}

dnnl::matmul::primitive_desc matmul_desc(const dnnl::memory::desc& x,
                                         const dnnl::memory::desc& weights,
                                         const dnnl::memory::desc* bias,
                                         const dnnl::memory::desc& y,
                                         const dnnl::primitive_attr& attr) {
#if DNNL_VERSION_MAJOR >= 3
  if (bias) return {engine(), x, weights, *bias, y, attr};
  return {engine(), x, weights, y, attr};
#else
  if (bias) return {{x, weights, *bias, y}, attr, engine()};
  return {{x, weights, y}, attr, engine()};
#endif
}

// A oneDNN without a kernel for a primitive takes loops that are ten thousand times slower, and
// says nothing. Up to this many multiplications (a hundredth of a second) nobody minds, and at
// CpuLevel::kReference everything is such loops.
constexpr int64_t kTinyProduct = 1 << 16;

// What made the primitives of this process, for onednn_primitives(). Throws Error{kInternal} for
// reference loops in earnest.
class Primitives {
 public:
  void add(std::string what, const std::string& implementation, int64_t multiplications) {
    what += ": " + implementation;
    const bool loops = implementation.find("ref") != std::string::npos;
    check(!loops || multiplications <= kTinyProduct || cpu_level() == CpuLevel::kReference,
          "oneDNN " + what + ", reference loops, which would take hours");
    const std::lock_guard lock(mutex_);
    lines_.insert(std::move(what));
  }
  std::vector<std::string> lines() const {
    const std::lock_guard lock(mutex_);
    return {lines_.begin(), lines_.end()};
  }

 private:
  mutable std::mutex mutex_;
  std::set<std::string> lines_;
};

Primitives& primitives() {
  static Primitives all;
  return all;
}

dnnl::memory::desc bias_desc(int64_t out) {
  return {{1, out}, dnnl::memory::data_type::f32, Tag::ab};
}

dnnl::matmul::primitive_desc make_desc(const Key& key, const dnnl::memory::desc& weights) {
  const dnnl::memory::desc x({key.rows, key.in}, onednn_type(key.compute),
                             dnnl::memory::dims{key.x_stride, 1});
  const dnnl::memory::desc y({key.rows, key.out}, onednn_type(key.output),
                             dnnl::memory::dims{key.y_stride, 1});
  const dnnl::memory::desc bias = bias_desc(key.out);
  dnnl::post_ops after;
  if (key.activation == Activation::kGelu) {
    append_eltwise(after, dnnl::algorithm::eltwise_gelu_erf);
  } else if (key.activation == Activation::kRelu) {
    append_eltwise(after, dnnl::algorithm::eltwise_relu);
  }
  if (key.gamma) after.append_binary(dnnl::algorithm::binary_mul, bias_desc(key.out));
  if (key.accumulate) after.append_sum(1.0f);
  dnnl::primitive_attr attr;
  attr.set_post_ops(after);
  attr.set_scratchpad_mode(dnnl::scratchpad_mode::user);
  const auto desc = matmul_desc(x, weights, key.bias ? &bias : nullptr, y, attr);
  primitives().add(
      fmt::format("matmul {}x{}x{} {}", key.rows, key.in, key.out, dtype_name(key.compute)),
      desc.impl_info_str(), key.rows * key.in * key.out);
  return desc;
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

// Without AVX-512 oneDNN multiplies by gamma in its reference loops only, so gamma goes into weight
// and bias: y += x (gamma W)^T + gamma b. Everything is f32 there, so that rounds as the product
// does.
ProductSpec with_gamma_folded(ProductSpec spec, std::vector<float>& weight) {
  std::vector<float> gamma = std::move(spec.options.gamma);
  spec.options.gamma.clear();
  spec.options.accumulate = true;
  for (size_t o = 0; o < gamma.size(); ++o) {
    const auto in = static_cast<size_t>(spec.in);
    for (size_t i = 0; i < in; ++i) weight[o * in + i] *= gamma[o];
    if (!spec.bias.empty()) spec.bias[o] *= gamma[o];
  }
  return spec;
}

class OnednnProduct : public Product {
 public:
  OnednnProduct(ProductSpec given, DType dtype, const std::byte* weight)
      : Product(std::move(given)) {
    const LinearOptions& options = spec().options;
    key_ = {kRowBlock,
            spec().in,
            spec().out,
            spec().in,
            spec().out,
            options.types.compute,
            options.output,
            options.activation,
            !spec().bias.empty(),
            !options.gamma.empty(),
            spec().accumulates()};
    pack(dtype, weight);
  }

  void run(int64_t rows, const Rows& x, const Rows& y) const override {
    const OneThread one_thread;
    Key key = key_;
    key.rows = rows;
    key.x_stride = x.stride;
    key.y_stride = y.stride;
    const std::shared_ptr<const Kernel> matmul = kernel(key, packed_desc_);
    const dnnl::matmul::primitive_desc& desc = matmul->desc;
    std::unordered_map<int, dnnl::memory> arguments{
        {DNNL_ARG_SRC, memory(desc.src_desc(), x.data)},
        {DNNL_ARG_WEIGHTS, memory(desc.weights_desc(), packed_.data())},
        {DNNL_ARG_DST, memory(desc.dst_desc(), y.data)},
        {DNNL_ARG_SCRATCHPAD,
         memory(desc.scratchpad_desc(), scratchpad(desc.scratchpad_desc().get_size()))}};
    if (key.bias) {
      arguments.emplace(DNNL_ARG_BIAS, memory(bias_desc(key.out), spec().bias.data()));
    }
    if (key.gamma) {
      arguments.emplace(DNNL_ARG_ATTR_MULTIPLE_POST_OP(0) | DNNL_ARG_SRC_1,
                        memory(bias_desc(key.out), spec().options.gamma.data()));
    }
    dnnl::stream stream(engine());
    matmul->matmul.execute(stream, arguments);
    stream.wait();
  }

  size_t packed_bytes() const override { return packed_.size(); }

 private:
  static dnnl::memory memory(const dnnl::memory::desc& desc, const void* data) {
    return {desc, engine(), const_cast<void*>(data)};
  }

  // In the layout that the product of a full block wants.
  void pack(DType dtype, const std::byte* weight) {
    const OneThread one_thread;
    const dnnl::memory::dims shape{key_.in, key_.out};
    packed_desc_ = make_desc(key_, dnnl::memory::desc(shape, onednn_type(key_.compute), Tag::any))
                       .weights_desc();
    packed_.reserve(packed_desc_.get_size());
    const dnnl::memory::desc source_desc(shape, onednn_type(dtype), Tag::ba);
    const dnnl::reorder::primitive_desc reorder(engine(), source_desc, engine(), packed_desc_);
    primitives().add(fmt::format("reorder {}x{} {} to {}", key_.in, key_.out, dtype_name(dtype),
                                 dtype_name(key_.compute)),
                     reorder.impl_info_str(), key_.in * key_.out);
    const dnnl::memory source = memory(source_desc, weight);
    dnnl::memory target = memory(packed_desc_, packed_.data());
    dnnl::stream stream(engine());
    dnnl::reorder(reorder).execute(stream, {{DNNL_ARG_FROM, source}, {DNNL_ARG_TO, target}});
    stream.wait();
  }

  Key key_;  // rows and strides are those of the call
  Buffer packed_;
  dnnl::memory::desc packed_desc_;
};

}  // namespace

std::unique_ptr<const Product> make_onednn_product(ProductSpec spec, DType dtype,
                                                   const std::byte* weight) {
  if (!spec.options.gamma.empty() && cpu_level() < CpuLevel::kAvx512) {
    std::vector<float> values(static_cast<size_t>(spec.in * spec.out));
    convert_to_float(dtype, weight, values.data(), spec.in * spec.out);
    ProductSpec folded = with_gamma_folded(std::move(spec), values);
    return std::make_unique<OnednnProduct>(std::move(folded), DType::kF32,
                                           reinterpret_cast<const std::byte*>(values.data()));
  }
  return std::make_unique<OnednnProduct>(std::move(spec), dtype, weight);
}

void limit_onednn_to_cpu_level() {
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

std::vector<std::string> onednn_primitives() { return primitives().lines(); }

}  // namespace vggtcd
