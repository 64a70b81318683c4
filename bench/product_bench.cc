// SPDX-License-Identifier: Apache-2.0
// One matrix product y = x W^T on VGGT-1B's linear layers: ours, oneDNN, BLIS and XNNPACK, in turn
// in one run, all with the same number of threads. GFLOP/s, and the ratio to oneDNN's best.
//
//   product_bench [f32|bf16]... [--rows 2082,10410] [--rounds 7]
//
// VGGTCD_ISA limits ours and oneDNN. BLIS chooses its kernels by BLIS_ARCH_TYPE, a number (of 0.9:
// 0 is skx with AVX-512, 3 is haswell with AVX2), and the table says which it took. XNNPACK cannot
// be limited. Weights are packed before, as far as a library can: BLIS packs in every call.
#include <dlfcn.h>
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <oneapi/dnnl/dnnl.hpp>
#include <thread>
#ifdef VGGTCD_HAS_XNNPACK
#include <pthreadpool.h>
#include <xnnpack.h>
#endif

#include "vggtcd/core/cpu_features.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/core/timer.h"
#include "vggtcd/nn/activation.h"
#include "vggtcd/nn/product.h"

namespace vggtcd::bench {
namespace {

struct Shape {
  int64_t in, out;
};
constexpr Shape kShapes[] = {{1024, 3072}, {1024, 1024}, {1024, 4096}, {4096, 1024}};

// x [rows, in], weight [out, in], y [rows, out]; values are spread evenly over [-0.5, 0.5).
struct Problem {
  int64_t rows, in, out;
  std::vector<float> x, weight, y;
  std::vector<uint16_t> x_bf16;

  Problem(int64_t row_count, const Shape& shape)
      : rows(row_count),
        in(shape.in),
        out(shape.out),
        x(values(rows * in, 1)),
        weight(values(in * out, 2)),
        y(static_cast<size_t>(rows * out)),
        x_bf16(x.size()) {
    bf16_from_f32(rows * in, x.data(), x_bf16.data());
  }

 private:
  static std::vector<float> values(int64_t count, uint32_t seed) {
    std::vector<float> made(static_cast<size_t>(count));
    uint32_t state = seed;
    for (float& value : made) {
      state = state * 1664525u + 1013904223u;
      value = static_cast<float>(state >> 8) * 0x1p-24f - 0.5f;
    }
    return made;
  }
};

struct Contender {
  std::string name;
  double rounding;  // bound of an answer's error, relative to the sum of absolute products
  std::function<void()> run;
  bool onednn = false;
  double best_s = std::numeric_limits<double>::infinity();
};

constexpr double kF32 = 1e-5, kBf16Weights = 0x1p-8, kBf16 = 0x1p-7;

// --- Ours, and oneDNN in blocks of rows through the same interface: a thread takes a block. ---

using MakeProduct = std::unique_ptr<const Product>(ProductSpec, DType, const std::byte*);

Contender in_blocks(std::string name, Problem& problem, const ProductTypes& types, double rounding,
                    MakeProduct make) {
  ProductSpec spec{problem.in, problem.out, {.types = types}, {}};
  const std::shared_ptr<const Product> product =
      make(std::move(spec), DType::kF32, reinterpret_cast<const std::byte*>(problem.weight.data()));
  const Rows x = types.compute == DType::kF32 ? Rows(problem.x.data(), problem.in)
                                              : Rows(problem.x_bf16.data(), problem.in);
  const Rows y(problem.y.data(), problem.out);
  return {std::move(name), rounding, [product, x, y, rows = problem.rows] {
            parallel_for(rows, kRowBlock, [&](int64_t begin, int64_t end) {
              product->run(end - begin, x.at(begin), y.at(begin));
            });
          }};
}

// --- oneDNN on all rows at once: its own threads, weights in the layout that it asks for. ---

struct Onednn {
  dnnl::engine engine{dnnl::engine::kind::cpu, 0};
  dnnl::stream stream{engine};

  dnnl::memory packed(const dnnl::memory::desc& wanted, const dnnl::memory::desc& plain,
                      const float* weight) {
    dnnl::memory source(plain, engine, const_cast<float*>(weight));
    dnnl::memory target(wanted, engine);
    dnnl::reorder(source, target).execute(stream, source, target);
    stream.wait();
    return target;
  }
};

template <typename Description>
Contender all_rows(std::string name, Problem& problem, bool bf16, Onednn& onednn,
                   const Description& description, const dnnl::memory::desc& plain_weight) {
  const dnnl::memory weight =
      onednn.packed(description.weights_desc(), plain_weight, problem.weight.data());
  void* const input = bf16 ? static_cast<void*>(problem.x_bf16.data()) : problem.x.data();
  const dnnl::memory x(description.src_desc(), onednn.engine, input);
  const dnnl::memory y(description.dst_desc(), onednn.engine, problem.y.data());
  name += fmt::format(" ({})", description.impl_info_str());
  return {std::move(name), bf16 ? kBf16 : kF32,
          [primitive = dnnl::primitive(description.get()), x, weight, y, &onednn] {
            primitive.execute(onednn.stream,
                              {{DNNL_ARG_SRC, x}, {DNNL_ARG_WEIGHTS, weight}, {DNNL_ARG_DST, y}});
            onednn.stream.wait();
          },
          true};
}

void add_onednn(std::vector<Contender>& contenders, Problem& problem, bool bf16, Onednn& onednn) {
  using dnnl::memory;
  using Tag = memory::format_tag;
  const auto f32 = memory::data_type::f32, type = bf16 ? memory::data_type::bf16 : f32;
  const memory::desc x({problem.rows, problem.in}, type, Tag::ab);
  const memory::desc y({problem.rows, problem.out}, f32, Tag::ab);
  const memory::dims turned{problem.in, problem.out}, straight{problem.out, problem.in};
  const memory::desc any_turned(turned, type, Tag::any), any_straight(straight, type, Tag::any);
  const auto inference = dnnl::prop_kind::forward_inference;
#if DNNL_VERSION_MAJOR >= 3
  const dnnl::matmul::primitive_desc matmul(onednn.engine, x, any_turned, y);
  const dnnl::inner_product_forward::primitive_desc inner(onednn.engine, inference, x, any_straight,
                                                          y);
#else
  const dnnl::matmul::primitive_desc matmul({x, any_turned, y}, onednn.engine);
  const dnnl::inner_product_forward::primitive_desc inner({inference, x, any_straight, y},
                                                          onednn.engine);
#endif
  contenders.push_back(
      all_rows("oneDNN matmul, all rows", problem, bf16, onednn, matmul, {turned, f32, Tag::ba}));
  contenders.push_back(all_rows("oneDNN inner product, all rows", problem, bf16, onednn, inner,
                                {straight, f32, Tag::ab}));
}

// --- BLIS, found at run time. ---

class Blis {
 public:
  Blis() : library_(dlopen("libblis.so.4", RTLD_NOW | RTLD_LOCAL)) {
    if (!library_) return;
    find<void()>("bli_init")();
    find<void(int64_t)>("bli_thread_set_num_threads")(num_threads());
    const int architecture = find<int()>("bli_arch_query_id")();
    name_ = fmt::format("BLIS {}, all rows ({})", find<const char*()>("bli_info_get_version_str")(),
                        find<const char*(int)>("bli_arch_string")(architecture));
    sgemm_ = find<Sgemm>("cblas_sgemm");
  }

  bool installed() const { return library_ != nullptr; }

  Contender contender(Problem& problem) const {
    return {name_, kF32, [sgemm = sgemm_, &problem] {
              constexpr int kRowMajor = 101, kPlain = 111, kTransposed = 112;
              const int rows = static_cast<int>(problem.rows), in = static_cast<int>(problem.in),
                        out = static_cast<int>(problem.out);
              sgemm(kRowMajor, kPlain, kTransposed, rows, out, in, 1.0f, problem.x.data(), in,
                    problem.weight.data(), in, 0.0f, problem.y.data(), out);
            }};
  }

 private:
  using Sgemm = void(int, int, int, int, int, int, float, const float*, int, const float*, int,
                     float, float*, int);

  template <typename Function>
  Function* find(const char* symbol) const {
    void* const address = dlsym(library_, symbol);
    if (!address) throw_error(ErrorCode::kInternal, "libblis.so.4: no {}", symbol);
    return reinterpret_cast<Function*>(address);
  }

  void* library_;
  Sgemm* sgemm_ = nullptr;
  std::string name_;
};

// --- XNNPACK, where CMake found it. ---

#ifdef VGGTCD_HAS_XNNPACK
Contender xnnpack(Problem& problem) {
  static pthreadpool_t const pool = [] {
    check(xnn_initialize(nullptr) == xnn_status_success, "XNNPACK: no kernels for this processor");
    return pthreadpool_create(static_cast<size_t>(num_threads()));
  }();
  const auto in = static_cast<size_t>(problem.in), out = static_cast<size_t>(problem.out);
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  xnn_operator_t created = nullptr;
  check(xnn_create_fully_connected_nc_f32(in, out, in, out, problem.weight.data(), nullptr,
                                          -kInfinity, kInfinity, 0, &created) == xnn_status_success,
        "XNNPACK: create");
  const bool limited = cpu_level() < detected_cpu_level();
  const std::shared_ptr<xnn_operator> layer(created, xnn_delete_operator);
  check(xnn_setup_fully_connected_nc_f32(layer.get(), static_cast<size_t>(problem.rows),
                                         problem.x.data(), problem.y.data(),
                                         pool) == xnn_status_success,
        "XNNPACK: setup");
  return {limited ? "XNNPACK, all rows (not limited)" : "XNNPACK, all rows", kF32, [layer] {
            check(xnn_run_operator(layer.get(), pool) == xnn_status_success, "XNNPACK: run");
          }};
}
#endif

// --- Measuring. ---

std::vector<Contender> make_contenders(Problem& problem, bool bf16, Onednn& onednn,
                                       const Blis& blis) {
  std::vector<Contender> all;
  const ProductTypes types = bf16 ? ProductTypes{DType::kBF16, DType::kBF16} : ProductTypes{};
  const auto add = [&](const char* name, double rounding, const ProductTypes& of, bool is_onednn,
                       MakeProduct make) {
    all.push_back(in_blocks(name, problem, of, rounding, make));
    all.back().onednn = is_onednn;
  };
  // What make_product takes; what it does not take is a line besides.
  const bool own = cpu_level() == CpuLevel::kAvx2;
  add(own ? "ours: panels, f32 weights" : "ours: oneDNN matmul, 128 rows", bf16 ? kBf16 : kF32,
      types, !own, make_product);
  if (!bf16) {
    add("ours: panels, bf16 weights", kBf16Weights, {DType::kF32, DType::kBF16}, false,
        make_product);
    add(own ? "oneDNN matmul, 128 rows" : "panels, f32 weights", kF32, types, own,
        own ? make_onednn_product : make_panel_product);
  }
  add_onednn(all, problem, bf16, onednn);
  if (bf16) return all;
  if (blis.installed()) all.push_back(blis.contender(problem));
#ifdef VGGTCD_HAS_XNNPACK
  all.push_back(xnnpack(problem));
#endif
  return all;
}

// Compares elements of y, spread over all of it, to plain sums.
void check_answer(const Problem& problem, const Contender& contender) {
  const int64_t size = problem.rows * problem.out;
  for (int64_t i = 0; i < size; i += 1 + size / 997) {
    const float* const x = problem.x.data() + i / problem.out * problem.in;
    const float* const weight = problem.weight.data() + i % problem.out * problem.in;
    double sum = 0, absolute = 0;
    for (int64_t k = 0; k < problem.in; ++k) {
      const double term = static_cast<double>(x[k]) * static_cast<double>(weight[k]);
      sum += term;
      absolute += std::abs(term);
    }
    const auto found = static_cast<double>(problem.y[static_cast<size_t>(i)]);
    if (!(std::abs(found - sum) <= contender.rounding * absolute)) {
      throw_error(ErrorCode::kInternal, "{}: expected {} at {}, found {}", contender.name, sum, i,
                  found);
    }
  }
}

// The first round warms up and is checked; the best of the others counts.
void measure(Problem& problem, std::vector<Contender>& contenders, int rounds) {
  for (int round = 0; round <= rounds; ++round) {
    for (Contender& contender : contenders) {
      if (round == 0) std::fill(problem.y.begin(), problem.y.end(), NAN);
      // A library's threads spin for a while after their work.
      std::this_thread::sleep_for(std::chrono::milliseconds(30));
      const Timer timer;
      contender.run();
      if (round > 0) contender.best_s = std::min(contender.best_s, timer.seconds());
      if (round == 0) check_answer(problem, contender);
    }
  }
}

// One table: a line for each contender, a column for each shape.
void run(int64_t rows, bool bf16, int rounds, Onednn& onednn, const Blis& blis) {
  fmt::print("\n{}, {} rows: GFLOP/s (ratio to oneDNN's best)\n{:58s}", bf16 ? "bf16" : "f32", rows,
             "");
  for (const Shape& s : kShapes) fmt::print("{:>16s}", fmt::format("{} -> {}", s.in, s.out));
  std::vector<std::string> lines;
  std::string notes;  // where a library takes another kernel than for the first shape
  for (const Shape& shape : kShapes) {
    Problem problem(rows, shape);
    std::vector<Contender> contenders = make_contenders(problem, bf16, onednn, blis);
    measure(problem, contenders, rounds);
    double onednn_s = std::numeric_limits<double>::infinity();
    for (const Contender& c : contenders) {
      if (c.onednn) onednn_s = std::min(onednn_s, c.best_s);
    }
    lines.resize(contenders.size());
    for (size_t i = 0; i < lines.size(); ++i) {
      const Contender& c = contenders[i];
      if (lines[i].empty()) lines[i] = fmt::format("{:58s}", c.name);
      if (!lines[i].starts_with(c.name))
        notes += fmt::format("{} -> {}: {}\n", shape.in, shape.out, c.name);
      const double gflop = 2e-9 * static_cast<double>(rows * shape.in * shape.out);
      lines[i] += fmt::format("{:9.0f} ({:.2f})", gflop / c.best_s, onednn_s / c.best_s);
    }
  }
  fmt::print("\n{}\n{}", fmt::join(lines, "\n"), notes);
}

}  // namespace
}  // namespace vggtcd::bench

int main(int argc, char** argv) {
  using namespace vggtcd;
  CLI::App app("One matrix product of VGGT-1B: ours, oneDNN, BLIS and XNNPACK");
  std::vector<std::string> kinds;
  std::vector<int64_t> rows{2082, 10410};  // tokens of 2 and of 10 views of 518 x 392
  int rounds = 7;
  app.add_option("kinds", kinds)->check(CLI::IsMember({"f32", "bf16"}));
  app.add_option("--rows", rows, "numbers of rows, a table each")
      ->delimiter(',')
      ->check(CLI::Range(1, 1 << 20));
  app.add_option("--rounds", rounds, "the best one counts")->check(CLI::Range(1, 1000));
  CLI11_PARSE(app, argc, argv);
  try {
    check(cpu_level() >= CpuLevel::kAvx2, "product_bench: needs AVX2");
    if (kinds.empty()) {
      kinds = bf16_is_fast() ? std::vector<std::string>{"f32", "bf16"}
                             : std::vector<std::string>{"f32"};
    }
    limit_onednn_to_cpu_level();
    bench::Onednn onednn;
    const bench::Blis blis;
    fmt::print("{} threads, instruction set {}\n", num_threads(), enum_to_string(cpu_level()));
    if (!blis.installed()) fmt::print("BLIS left out: no libblis.so.4\n");
#ifndef VGGTCD_HAS_XNNPACK
    fmt::print("XNNPACK left out: not found when this was built\n");
#endif
    for (const std::string& kind : kinds) {
      check(kind == "f32" || bf16_is_fast(), "product_bench: bf16 needs AVX512_BF16");
      for (const int64_t count : rows) {
        bench::run(count, kind == "bf16", rounds, onednn, blis);
      }
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "product_bench: {}\n", error.what());
    return 1;
  }
  return 0;
}
