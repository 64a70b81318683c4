// SPDX-License-Identifier: Apache-2.0
// Sim(3) in files: {"scale": s, "rotation": [[...], ...], "translation": [...]}, and the authors'
// .npz with s, R and t.
#pragma once

#include <filesystem>
#include <string_view>

#include "vggtcd/geometry/sim3.h"
#include "vggtcd/io/json_file.h"

namespace vggtcd {

// x_b = scale * rotation * x_a + translation; the rotation in rows.
Json sim3_to_json(const Sim3& b_from_a);

// Ignores other members. Throws Error{kInput} naming `where` unless scale > 0 and the rotation is
// one within 1e-2; it is replaced by the nearest exact one.
Sim3 sim3_from_json(const Json& json, std::string_view where);

// A .json file as above or an .npz with s, R, t. Throws Error{kInput}.
Sim3 read_sim3(const std::filesystem::path& path);

// s [], R [3, 3], t [3], all f64. Throws Error{kOutput}.
void write_sim3_npz(const std::filesystem::path& path, const Sim3& b_from_a);

}  // namespace vggtcd
