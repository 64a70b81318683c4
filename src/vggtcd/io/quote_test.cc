// SPDX-License-Identifier: Apache-2.0
#include "vggtcd/io/quote.h"

#include <gtest/gtest.h>

namespace vggtcd {
namespace {

TEST(Escaped, KeepsTextOfAllLanguages) {
  for (const char* text : {"", "IMG_1.jpg", "Küche 東京 😀.jpg", "a\\b \"c\""}) {
    EXPECT_EQ(escaped(text), text);
  }
}

TEST(Escaped, ShowsWhatWouldActOnATerminal) {
  EXPECT_EQ(escaped("a\x1b[2J\x07\n\tb\x7f"), "a\\x1b[2J\\x07\\x0a\\x09b\\x7f");
  EXPECT_EQ(escaped("\xc2\x9b"
                    "31m"),
            "\\xc2\\x9b31m");  // the same in one character
  EXPECT_EQ(escaped("\xe2\x80\xae"
                    "gpj.x"),
            "\\xe2\\x80\\xaegpj.x");                      // read from the right
  EXPECT_EQ(escaped("\xe2\x80\xa8"), "\\xe2\\x80\\xa8");  // a line separator
}

TEST(Escaped, ShowsBytesThatAreNotUtf8) {
  EXPECT_EQ(escaped("caf\xe9.jpg"), "caf\\xe9.jpg");
  EXPECT_EQ(escaped("\xc3"), "\\xc3");
  EXPECT_EQ(escaped("\xc0\xaf"), "\\xc0\\xaf");                    // a detour to a slash
  EXPECT_EQ(escaped("\xed\xa0\x80"), "\\xed\\xa0\\x80");           // half of a pair
  EXPECT_EQ(escaped("\xf5\x80\x80\x80"), "\\xf5\\x80\\x80\\x80");  // beyond Unicode
}

TEST(SingleLine, EscapesControlCharactersOnlyAndOnce) {
  EXPECT_EQ(single_line("a\n\x1b caf\xe9 \xc3\xa9"), "a\\x0a\\x1b caf\xe9 \xc3\xa9");
  EXPECT_EQ(single_line(single_line("a\nb")), single_line("a\nb"));
}

}  // namespace
}  // namespace vggtcd
