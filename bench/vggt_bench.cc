// SPDX-License-Identifier: Apache-2.0
// The whole network, VGGT-1B with weights of the recipe: time against the time that oneDNN's best
// rate on the network's own products, measured in the same run, would need for its operations.
//
//   vggt_bench [--views N,N,..] [--size WIDTHxHEIGHT] [--precision f32|bf16_weights|bf16]
//   [--weights FILE] [--points] [--answer OUT.npz]     VGGTCD_ISA chooses the instruction set
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cmath>
#include <fstream>

#include "bench/gemm_rate.h"
#include "tests/support/weight_recipe.h"
#include "vggtcd/core/cpu_features.h"
#include "vggtcd/core/parallel.h"
#include "vggtcd/core/timer.h"
#include "vggtcd/vggt/batch_file.h"
#include "vggtcd/vggt/model.h"

namespace {

using namespace vggtcd;

// Starts the peak of resident memory afresh (Linux: clear_refs 5).
void reset_peak_memory() { std::ofstream("/proc/self/clear_refs") << "5"; }

double gigabytes(int64_t bytes) { return static_cast<double>(bytes) * 1e-9; }

// Smooth pictures that differ from frame to frame: values do not change the amount of work.
ImageBatch make_images(int64_t frames, int64_t height, int64_t width) {
  ImageBatch images{frames, height, width, {}, {}};
  images.pixels.resize(static_cast<size_t>(frames * 3 * height * width));
  for (size_t i = 0; i < images.pixels.size(); ++i) {
    images.pixels[i] = 0.5f + 0.4f * std::sin(static_cast<float>(i % 100003) * 0.013f);
  }
  return images;
}

// Without a file: weights of the recipe.
Vggt load(const std::string& path, const VggtOptions& options) {
  if (!path.empty()) {
    reset_peak_memory();
    const Timer timer;
    Vggt model = Vggt::load(path, options);
    fmt::print("loading {}: {:.2f} s, peak memory {:.2f} GB\n", path, timer.seconds(),
               gigabytes(peak_memory_bytes()));
    return model;
  }
  const testing::RecipeWeights weights(testing::NetworkSizes::vggt_1b(), 7);
  const Timer timer;
  Vggt model = Vggt::from_tensors(weights.tensors(), weights.config_json(), "recipe", options);
  fmt::print("packing the weights: {:.2f} s\n", timer.seconds());
  return model;
}

void print_stages(const Prediction& prediction, const VggtCost& cost, double total_s) {
  fmt::print("{:18s} {:>10s} {:>8s} {:>9s} {:>7s}\n", "stage", "GFLOP", "s", "GFLOP/s", "share");
  for (size_t i = 0; i < kNumVggtStages; ++i) {
    if (cost.flop[i] == 0) continue;
    const double s = prediction.seconds[i];
    fmt::print("{:18s} {:10.0f} {:8.2f} {:9.0f} {:6.1f}%\n", stage_name(VggtStage(i)),
               cost.flop[i] * 1e-9, s, cost.flop[i] * 1e-9 / s, 100 * s / total_s);
  }
}

Prediction run(const Vggt& model, const ImageBatch& images, bool points, double gemm_gflops) {
  const auto [frames, height, width] = std::array{images.frames, images.height, images.width};
  const VggtRun shape{frames, height, width, model.precision(), true, points};
  reset_peak_memory();
  const Timer timer;
  Prediction prediction = model.reconstruct(images);
  const double total_s = timer.seconds();
  const int64_t peak = peak_memory_bytes();
  const VggtCost cost = cost_of(model.config(), shape);
  const VggtMemory planned = memory_of(model.config(), shape);
  fmt::print("\n{} views of {}x{}: {:.1f} TFLOP, attention {:.0f} %\n", frames, width, height,
             cost.total_flop() * 1e-12, 100 * cost.attention_flop / cost.total_flop());
  print_stages(prediction, cost, total_s);
  fmt::print("time {:.2f} s = {:.2f} x the time at {:.0f} GFLOP/s\n", total_s,
             total_s / (cost.total_flop() * 1e-9 / gemm_gflops), gemm_gflops);
  fmt::print("peak memory {:.2f} GB; planned {:.2f} + {:.2f} GB\n", gigabytes(peak),
             gigabytes(planned.weights), gigabytes(planned.activations));
  return prediction;
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("VGGT-1B on synthetic photos against the rate of oneDNN's matrix product");
  std::vector<int64_t> views{10};
  std::string size = "518x392", asked = "auto", weights, answer;
  bool points = false;
  app.add_option("--views", views, "numbers of photos, one pass each")->delimiter(',');
  app.add_option("--size", size, "WIDTHxHEIGHT of a photo, multiples of 14");
  app.add_option("--precision", asked)
      ->check(CLI::IsMember({"auto", "f32", "bf16_weights", "bf16"}));
  app.add_option("--weights", weights, "a weights file instead of the recipe; its load is timed");
  app.add_flag("--points", points, "the point head too");
  app.add_option("--answer", answer, "the prediction file to write, of the last pass");
  CLI11_PARSE(app, argc, argv);
  try {
    Precision precision = Precision::kAuto;
    for (const auto& entry : enum_names(precision)) {
      if (entry.name == asked) precision = entry.value;
    }
    precision = resolve_precision(precision);
    const bool bf16 = product_types(precision).compute == DType::kBF16;
    const size_t cross = size.find('x');
    const int64_t width = std::stoll(size), height = std::stoll(size.substr(cross + 1));
    const auto rates = bench::measure_gemm_rates(bf16);
    for (const auto& rate : rates) {
      fmt::print("oneDNN {} [{}, {}] x [{}, {}]: {:.0f} GFLOP/s\n", bf16 ? "bf16" : "f32",
                 rate.rows, rate.in, rate.in, rate.out, rate.gflops);
    }
    const Vggt model = load(weights, {.precision = precision, .point_head = points});
    fmt::print("precision {} on {}, {} threads\n", enum_to_string(precision),
               enum_to_string(cpu_level()), num_threads());
    for (const int64_t frames : views) {
      const ImageBatch images = make_images(frames, height, width);
      const Prediction prediction = run(model, images, points, bench::best_gflops(rates));
      if (!answer.empty()) write_prediction(answer, images, prediction);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "vggt_bench: {}\n", error.what());
    return 1;
  }
  return 0;
}
