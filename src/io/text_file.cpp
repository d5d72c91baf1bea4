#include "io/text_file.h"

#include <cmath>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <vector>

namespace dtsdf {
namespace {

namespace fs = std::filesystem;

/// Maximum file size; lists and images are expected to be smaller.
constexpr uintmax_t kMaxBytes = uintmax_t{1} << 30;

/// The reason why a file cannot be read as a whole; empty if it can. Devices and pipes are rejected
/// because they may be endless or block.
std::string whyUnreadable(const std::string& path) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) return "no such file";
  if (!fs::is_regular_file(status)) return "it is a folder, a device or a pipe";
  return fs::file_size(path, error) > kMaxBytes ? "it is larger than 1 GiB" : "";
}

/// @return false if the file cannot be opened or read.
bool readWhole(const std::string& path, std::string& text) {
  std::ifstream file(path, std::ios::binary);
  std::vector<char> part(1 << 16);
  while (file) {
    file.read(part.data(), static_cast<std::streamsize>(part.size()));
    text.append(part.data(), static_cast<size_t>(file.gcount()));
  }
  return file.eof() && !file.bad();
}

}  // namespace

void requireRegularFile(const std::string& path, const std::string& advice) {
  const std::string problem = whyUnreadable(path);
  if (problem.empty()) return;
  throw std::runtime_error("cannot read '" + path + "': " + problem + "; " + advice);
}

std::string readTextFile(const std::string& path, const std::string& advice) {
  requireRegularFile(path, advice);
  std::string text;
  if (!readWhole(path, text)) {
    throw std::runtime_error("cannot read '" + path + "': read error; " + advice);
  }
  constexpr char kByteOrderMark[] = "\xef\xbb\xbf";  // text from Windows may begin with it
  if (text.rfind(kByteOrderMark, 0) == 0) text.erase(0, sizeof(kByteOrderMark) - 1);
  return text;
}

std::vector<std::string> splitWords(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> words;
  for (std::string word; in >> word;) words.push_back(word);
  return words;
}

std::vector<ListLine> readList(const std::string& path, const std::string& advice) {
  std::istringstream text(readTextFile(path, advice));
  std::vector<ListLine> lines;
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    std::vector<std::string> words = splitWords(line);  // a carriage return counts as white space
    if (words.empty() || words[0][0] == '#') continue;
    lines.push_back({std::move(words), path + ":" + std::to_string(number)});
  }
  return lines;
}

void throwAt(const ListLine& line, const std::string& problem) {
  throw std::runtime_error(line.place + ": " + problem);
}

double numberAt(const ListLine& line, size_t index) {
  double number = 0.0;
  if (!parseNumber(line.words[index], number) || !std::isfinite(number)) {
    throwAt(line, "'" + line.words[index] + "' is not a number");
  }
  return number;
}

}  // namespace dtsdf
