#include "io/list_file.h"

#include <cmath>
#include <stdexcept>

#include "io/text_file.h"

namespace dtsdf {

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
    std::vector<std::string> words = splitWords(line);  // takes a carriage return as a space
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
