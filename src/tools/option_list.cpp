#include "tools/option_list.h"

#include <cmath>
#include <sstream>

#include "io/text_file.h"

namespace dtsdf {
namespace {

bool isOption(const std::string& argument) { return argument.rfind("--", 0) == 0; }

}  // namespace

size_t parseCount(const std::string& name, const std::string& text, size_t min) {
  long long number = 0;
  if (!parseNumber(text, number) || number < static_cast<long long>(min)) {
    throw UsageError(name + ": '" + text + "' is not a whole number from " + std::to_string(min) +
                     " on");
  }
  return static_cast<size_t>(number);
}

int parseThreads(const std::string& text) {
  int number = 0;
  if (!parseNumber(text, number) || number < 0) {
    throw UsageError("--threads: '" + text + "' is not a whole number from 0 on");
  }
  return number;
}

double parsePositive(const std::string& name, const std::string& text) {
  double number = 0.0;
  if (!parseNumber(text, number) || !std::isfinite(number) || !(number > 0.0)) {
    throw UsageError(name + ": '" + text + "' is not a number above 0");
  }
  return number;
}

std::string parseBackend(const std::string& text) {
  if (text != "auto" && text != "cpu" && text != "cuda") {
    throw UsageError("--backend: '" + text + "' is none of auto, cpu and cuda");
  }
  return text;
}

/// The form only: what the keys and values mean is told with the settings of the file.
std::string parseSetting(const std::string& text) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size()) {
    throw UsageError("--set: '" + text + "' is not of the form KEY=VALUE");
  }
  return text;
}

std::string wrapHelp(const std::string& text) {
  constexpr size_t kColumns = 80;
  const std::string indent = "      ";
  std::istringstream words(text);
  std::string wrapped, line = indent;
  for (std::string word; words >> word;) {
    if (line.size() + word.size() > kColumns) {
      wrapped += line + "\n";
      line = indent;
    }
    line += (line == indent ? "" : " ") + word;
  }
  return wrapped + line + "\n";
}

FrameSelection parseFrameSelection(const std::string& text) {
  FrameSelection selection;
  size_t* const parts[] = {&selection.first, &selection.last, &selection.step};
  size_t begin = 0;
  for (size_t i = 0; i < 3; ++i) {
    const size_t colon = text.find(':', begin);
    const std::string part = text.substr(begin, colon - begin);
    if (!part.empty()) *parts[i] = parseCount("--frames", part, i == 2 ? 1 : 0);
    if (colon == std::string::npos) {
      if (i == 0) break;  // no colon at all
      if (selection.first > selection.last) {
        throw UsageError("--frames: LAST comes before FIRST in '" + text + "'");
      }
      return selection;
    }
    begin = colon + 1;
  }
  throw UsageError("--frames: '" + text + "' is not of the form FIRST:LAST:STEP");
}

std::pair<std::string, std::optional<std::string>> OptionReader::nextName() {
  const std::string& argument = arguments[index++];
  if (argument == "-h") return {"--help", std::nullopt};
  const size_t equals = isOption(argument) ? argument.find('=') : std::string::npos;
  if (equals == std::string::npos) return {argument, std::nullopt};
  return {argument.substr(0, equals), argument.substr(equals + 1)};
}

std::optional<std::string> OptionReader::nextValue() {
  if (atEnd() || isOption(arguments[index])) return std::nullopt;
  return arguments[index++];
}

void OptionReader::markGiven(const std::string& name, bool may_repeat) {
  if (!given.insert(name).second && !may_repeat) throw UsageError(name + " is given twice");
}

}  // namespace dtsdf
