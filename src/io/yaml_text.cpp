#include "io/yaml_text.h"

#include <yaml-cpp/eventhandler.h>

#include <algorithm>
#include <sstream>

namespace dtsdf {
namespace {

/// More than any file of settings has; the parser calls itself for each level.
constexpr size_t kMostTextBytes = size_t{1} << 20;
constexpr int kMaxBrackets = 10000, kMaxDashesOfLine = 50;
constexpr int kMaxDepth = 50;

/// Sees a document's parts as they are read, before anything is built of them.
class PlainDocument : public YAML::EventHandler {
 public:
  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark&, YAML::anchor_t) override {}
  void OnScalar(const YAML::Mark&, const std::string&, YAML::anchor_t,
                const std::string&) override {}
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override {
    throw YAML::Exception(mark, "YAML references are not supported; write the value out");
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    enter(mark);
  }
  void OnSequenceEnd() override { --depth_; }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    enter(mark);
  }
  void OnMapEnd() override { --depth_; }

 private:
  void enter(const YAML::Mark& mark) {
    if (++depth_ > kMaxDepth) throw YAML::Exception(mark, "too many levels");
  }

  int depth_ = 0;
};

/// What would have the parser call itself too often, on a glance at the text alone.
void checkText(const std::string& text) {
  const YAML::Mark nowhere = YAML::Mark::null_mark();
  if (text.size() > kMostTextBytes) throw YAML::Exception(nowhere, "too large for settings");
  if (text.find('\0') != text.npos)
    throw YAML::Exception(nowhere, "a string must not contain a NUL character");
  const auto isOpening = [](char c) { return c == '[' || c == '{'; };
  if (std::count_if(text.begin(), text.end(), isOpening) > kMaxBrackets) {
    throw YAML::Exception(nowhere, "too many brackets");
  }
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const auto isIndicator = [](char c) { return c == '-' || c == '?'; };
    const size_t first = line.find_first_not_of("-? \t");
    if (std::count_if(line.begin(), line.begin() + std::min(first, line.size()), isIndicator) >
        kMaxDashesOfLine) {
      throw YAML::Exception(nowhere, "too many levels");
    }
  }
}

}  // namespace

YAML::Node loadYaml(const std::string& text) {
  checkText(text);
  std::istringstream in(text);
  YAML::Parser parser(in);
  PlainDocument document;
  if (parser.HandleNextDocument(document) && parser.HandleNextDocument(document)) {
    throw YAML::Exception(YAML::Mark::null_mark(), "more than one YAML document; use one");
  }
  return YAML::Load(text);
}

}  // namespace dtsdf
