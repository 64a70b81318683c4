// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/report/overlay_names.h"

#include <gmock/gmock.h>

namespace vggtcd {
namespace {

using ::testing::ElementsAre;

std::vector<std::string> of(const std::vector<std::string>& names) { return overlay_names(names); }

TEST(OverlayNames, LeaveTheExtensionOutWhereThatIsClear) {
  EXPECT_THAT(of({"a.jpg", "b.x.JPG", "c"}), ElementsAre("a.png", "b.x.png", "c.png"));
  EXPECT_THAT(of({"a.jpg", "a.png", "c.jpg"}), ElementsAre("a.jpg.png", "a.png.png", "c.jpg.png"));
  EXPECT_THAT(of({"a.jpg", "a.png", "a.jpg.gif"}),
              ElementsAre("a.jpg.png", "a.png.png", "a.jpg.gif.png"));
}

TEST(OverlayNames, AreTheSameForNamesOfPhotosAndForThoseThatAColmapModelKeeps) {
  EXPECT_THAT(of({"a\nb.jpg", "caf\xe9.jpg"}), ElementsAre("a\\x0ab.png", "caf\xe9.png"));
  EXPECT_THAT(of({"a\\x0ab.jpg", "caf\xe9.jpg"}), ElementsAre("a\\x0ab.png", "caf\xe9.png"));
}

}  // namespace
}  // namespace vggtcd
