#include "params/printable.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <stdexcept>

namespace dtsdf {
namespace {

TEST(Printable, LeavesPrintableTextUnchanged) {
  for (const char* text :
       {"", "camera_link", "K\u00fcche", "\u53f0\u6240", "\U0001f600", "a\u00a0b"}) {
    EXPECT_EQ(printable(text), text);
    EXPECT_FALSE(hasControlCharacter(text));
  }
}

TEST(Printable, EscapesControlCharacters) {
  EXPECT_EQ(printable("a\nb\rc\td"), "a\\x0ab\\x0dc\\x09d");
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a\\x00b");
  EXPECT_EQ(printable("\x1b[2J\x7f"), "\\x1b[2J\\x7f");
  EXPECT_EQ(printable("\u0085"), "\\xc2\\x85") << "a control character (next line)";
  EXPECT_EQ(printable("\u009b2J"), "\\xc2\\x9b2J")
      << "a control character (control sequence introducer)";
  EXPECT_EQ(printable("\u2028"), "\\xe2\\x80\\xa8");
}

TEST(Printable, EscapesDirectionalFormatting) {
  for (const char* text : {"\u061c", "\u200e", "\u200f", "\u202a", "\u202e", "\u2066", "\u2069"}) {
    EXPECT_EQ(printable(text).substr(0, 2), "\\x");
    EXPECT_TRUE(hasControlCharacter(text));
  }
}

TEST(Printable, EscapesInvalidUtf8) {
  EXPECT_EQ(printable("\x9b"), "\\x9b") << "a C1 control character as a single byte";
  EXPECT_EQ(printable("a\xc3"), "a\\xc3") << "a truncated character";
  EXPECT_EQ(printable("\xc0\x8a"), "\\xc0\\x8a") << "an overlong line feed";
  EXPECT_EQ(printable("\xe0\x80\x8a"), "\\xe0\\x80\\x8a");
  EXPECT_EQ(printable("\xed\xa0\x80"), "\\xed\\xa0\\x80") << "half of a surrogate pair";
  EXPECT_EQ(printable("\xf5\x80\x80\x80"), "\\xf5\\x80\\x80\\x80");
}

TEST(Printable, IsTruncated) {
  EXPECT_EQ(printable(std::string(200, 'x')), std::string(200, 'x'));
  EXPECT_EQ(printable(std::string(201, 'x')), std::string(200, 'x') + "...");
  EXPECT_EQ(printable("\u00fc\u00fc\u00fc", 2), "\u00fc\u00fc...");
  EXPECT_FALSE(hasControlCharacter(std::string(1000, 'x')));
}

TEST(ErrorText, IsOneReadableLine) {
  EXPECT_EQ(errorText(std::runtime_error("no file 'a';\ngive \x1b")), "no file 'a'; give \\x1b");
  std::string text;
  try {
    static_cast<void>(std::filesystem::file_size("/" + std::string(300, 'x')));
  } catch (const std::exception& error) {
    text = errorText(error);
  }
  EXPECT_EQ(text.find("filesystem error"), std::string::npos) << text;
  EXPECT_NE(text.find("File name too long"), std::string::npos) << text;
  const std::filesystem::filesystem_error loop(
      "status", "loop", std::make_error_code(std::errc::too_many_symbolic_link_levels));
  EXPECT_EQ(errorText(loop),
            "'loop' is a link that leads to itself; give the path of the actual file or folder");
}

}  // namespace
}  // namespace dtsdf
