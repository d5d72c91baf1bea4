#include "io/block_mesh_file.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <system_error>

#include "io/atomic_file.h"
#include "io/file_hash.h"
#include "io/little_endian.h"
#include "kernels/core/grid.h"

namespace dtsdf {
namespace {

// Numbers are copied as they lie in memory (little_endian.h).
static_assert(sizeof(BlockVertex) == 16 && sizeof(VertexColour) == 4 && sizeof(BlockKey) == 12,
              "without gaps");

constexpr char kMeshMagic[] = "DTSDFMSH";
constexpr uint32_t kMeshVersion = 1;
/// More than the units of a block can have: 8 x 8 x 8 of 2 sheets, each refined.
constexpr uint32_t kMostOfBlock = 1 << 20;

struct Header {
  char magic[8];
  uint32_t version, unused;
  BlockMeshCounts counts;
};
static_assert(sizeof(Header) == 40, "without gaps");

struct BlockHeader {
  BlockKey key;
  uint32_t vertices, indices, colours;
};
static_assert(sizeof(BlockHeader) == 24, "without gaps");

class HashedFile {
 public:
  explicit HashedFile(const std::string& path) : file_(path) {}

  template <class Item>
  void write(const Item* items, size_t count) {
    hash_.add(items, count * sizeof(Item));
    file_.write(items, count * sizeof(Item));
  }

  uint64_t finish() {
    const uint64_t hash = hash_.result();
    file_.write(&hash, sizeof(hash));
    file_.commit();
    return hash;
  }

 private:
  AtomicFile file_;
  RunningHash hash_;
};

}  // namespace

uint64_t saveBlockMeshes(const BlockMeshVisit& visit, const std::string& path) {
  Header header = {};
  std::copy_n(kMeshMagic, sizeof(header.magic), header.magic);
  header.version = kMeshVersion;
  visit([&](const BlockMesh& mesh) {
    ++header.counts.blocks;
    header.counts.vertices += mesh.vertices.size();
    header.counts.triangles += mesh.triangles.size() / 3;
  });
  HashedFile file(path);
  file.write(&header, 1);
  visit([&](const BlockMesh& mesh) {
    const BlockHeader block{mesh.key, static_cast<uint32_t>(mesh.vertices.size()),
                            static_cast<uint32_t>(mesh.triangles.size()),
                            static_cast<uint32_t>(mesh.colours.size())};
    file.write(&block, 1);
    file.write(mesh.vertices.data(), mesh.vertices.size());
    file.write(mesh.triangles.data(), mesh.triangles.size());
    file.write(mesh.colours.data(), mesh.colours.size());
  });
  return file.finish();
}

struct BlockMeshReader::State {
  explicit State(const std::string& file_path) : path(file_path) {
    file.reset(std::fopen(path.c_str(), "rbe"));
    if (file == nullptr) {
      throw std::runtime_error("cannot read '" + path +
                               "': " + std::generic_category().message(errno));
    }
    Header header;
    read(&header, 1);
    if (!std::equal(header.magic, header.magic + sizeof(header.magic), kMeshMagic)) {
      throwDamaged("it has another signature");
    }
    if (header.version != kMeshVersion) throwDamaged("it has another version");
    counts = header.counts;
  }

  template <class Item>
  void read(Item* items, size_t count) {
    if (count > 0 && std::fread(items, sizeof(Item), count, file.get()) != count) {
      throwDamaged("its end is missing");
    }
    hash.add(items, count * sizeof(Item));
  }

  template <class Item>
  void read(std::vector<Item>& items, uint32_t count) {
    items.resize(count);
    read(items.data(), count);
  }

  std::optional<BlockMesh> next() {
    if (blocks == counts.blocks) {
      finish();
      return std::nullopt;
    }
    BlockHeader header;
    read(&header, 1);
    checkBlock(header);
    BlockMesh mesh;
    mesh.key = header.key;
    read(mesh.vertices, header.vertices);
    read(mesh.triangles, header.indices);
    read(mesh.colours, header.colours);
    for (const uint16_t index : mesh.triangles) {
      if (index >= mesh.vertices.size()) throwDamaged("a triangle has no such vertex");
    }
    ++blocks;
    return mesh;
  }

  void checkBlock(const BlockHeader& header) {
    if (!isRepresentable(header.key) || header.vertices > kMostOfBlock ||
        header.indices > kMostOfBlock || header.indices % 3 != 0 ||
        (header.colours != 0 && header.colours != header.vertices)) {
      throwDamaged("the sizes of a block are inconsistent");
    }
    const PackedKey key = packKey(header.key);
    if (blocks > 0 && key <= last) throwDamaged("blocks are not in the order of their keys");
    last = key;
  }

  void finish() {
    if (finished) return;
    checksum = hash.result();
    uint64_t expected = 0;
    read(&expected, 1);
    if (expected != checksum) throwDamaged("its checksum does not match");
    if (std::fgetc(file.get()) != EOF) throwDamaged("there is data after its end");
    finished = true;
  }

  [[noreturn]] void throwDamaged(const std::string& how) const {
    throw std::runtime_error("the meshes of '" + path + "' are damaged (" + how +
                             "); make them again");
  }

  struct Close {
    // What is in it was read by now, or is not wanted.
    void operator()(std::FILE* open) const { static_cast<void>(std::fclose(open)); }
  };

  const std::string path;
  std::unique_ptr<std::FILE, Close> file;
  BlockMeshCounts counts;
  RunningHash hash;
  uint64_t blocks = 0;  ///< That were read.
  PackedKey last = 0;
  bool finished = false;
  uint64_t checksum = 0;
};

BlockMeshReader::BlockMeshReader(const std::string& path) : state_(std::make_unique<State>(path)) {}
BlockMeshReader::~BlockMeshReader() = default;
BlockMeshReader::BlockMeshReader(BlockMeshReader&&) noexcept = default;

const BlockMeshCounts& BlockMeshReader::counts() const { return state_->counts; }
std::optional<BlockMesh> BlockMeshReader::next() { return state_->next(); }
uint64_t BlockMeshReader::checksum() const { return state_->checksum; }

}  // namespace dtsdf
