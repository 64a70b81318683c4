# SPDX-License-Identifier: Apache-2.0
# Turns the page into C++: cmake -D IN=index.html -D OUT=page_template.cc -P embed_file.cmake
file(READ ${IN} hex HEX)
string(REGEX REPLACE "(..)" "0x\\1," bytes "${hex}")
string(REGEX REPLACE "(................................................................................)"
       "\\1\n" bytes "${bytes}")
file(WRITE ${OUT}
"// SPDX-License-Identifier: Apache-2.0
// Made from viewer/ by cmake/embed_file.cmake.
#include \"vggtcd/report/page_template.h\"

namespace vggtcd {
namespace {
const unsigned char kPage[] = {
${bytes}};
}  // namespace

std::string_view page_template() { return {reinterpret_cast<const char*>(kPage), sizeof(kPage)}; }

}  // namespace vggtcd
")
