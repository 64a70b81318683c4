// SPDX-License-Identifier: Apache-2.0
// The door between the benchmark and Open3D: plain C, so that the plugin carries nothing of ours
// and the program nothing of Open3D's (nearly 200 libraries) unless a rival is asked for.
#pragma once

#include <cstdint>

extern "C" {

struct VggtcdRivalCloud {
  const double* positions;  // [size, 3]
  const double* colors;     // [size, 3] in [0, 1]
  int64_t size;
};

// target = scale * rotation * source + translation; rotation by rows.
struct VggtcdRivalAnswer {
  double scale;
  double rotation[9];
  double translation[3];
  char message[256];  // one sentence if there is no answer
};

// rival: "fgr", "ransac_icp" or "scale_icp". 0: answered; 1: no answer, see the message.
using VggtcdAlignRival = int(const char* rival, const VggtcdRivalCloud* source,
                             const VggtcdRivalCloud* target, VggtcdRivalAnswer* answer);
}
