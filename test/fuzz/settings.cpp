// Fuzzes the readers for settings: YAML with the node's parameters, and KEY=VALUE arguments.
#include "dtsdf_mapping/io/yaml_params.h"
#include "fuzz/fuzz_input.h"
#include "params/node_params.h"

using namespace dtsdf;

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  const std::string text(data, data + size);
  expectAnswer([&] {
    const NodeParams params = readNodeParams(parseYamlParams(text, "settings"));
    require(params.mapper.map.voxel_size_m > 0.0f && params.input.queue_size > 0,
            "settings within their limits");
  });
  expectAnswer([&] {
    ParamTree tree;
    setParam(text, tree);
    require(tree.size() == 1, "exactly one setting");
  });
  return 0;
}
