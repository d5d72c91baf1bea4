// Tests that a block is refused rather than stored in part if memory runs out.
#include "page/paged_blocks.h"

#include <gtest/gtest.h>

#include "support/failing_allocations.h"
#include "support/temporary_folder.h"

namespace dtsdf {
namespace {

TEST(PagedBlocks, RefusesBlocksIfMemoryRunsOut) {
  constexpr int32_t kBlocks = 40;
  TemporaryFolder folder;
  const std::vector<char> words(256);
  int refused = 0;
  bool is_done = false;
  for (int allocations = 0; !is_done; ++allocations) {
    PagedBlocks blocks(folder.path(), size_t{64} << 20, size_t{64} << 20);
    std::vector<BlockKey> there;
    there.reserve(kBlocks);
    for (int32_t i = 0; i < kBlocks; ++i) {
      const BlockKey key{10 * i, 0, 0};  // in 25 coarse cells (see BlockCells)
      RecordBytes record{nullptr, {{words.data(), words.size()}}};
      allocations_left = i == kBlocks / 2 ? allocations : -1;
      const bool is_put = blocks.put({{key, 0, 0}, 0, {}}, std::move(record));
      if (i == kBlocks / 2) is_done = allocations_left >= 0;
      allocations_left = -1;
      if (is_put) there.push_back(key);
      refused += !is_put;
      ASSERT_EQ(blocks.find(packKey(key)) >= 0, is_put);
    }
    ASSERT_EQ(blocks.count(), there.size());
    const auto any = [](const auto&) { return true; };
    ASSERT_EQ(blocks.keysWhere(any, any).size(), there.size());
    for (const BlockKey& key : there) blocks.erase(blocks.find(packKey(key)));
    EXPECT_EQ(blocks.keysWhere(any, any).size(), 0u);
    EXPECT_EQ(blocks.store().stats().bytes, 0u);
  }
  EXPECT_GT(refused, 2);
}

}  // namespace
}  // namespace dtsdf
