#include "io/ply_stream.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <system_error>
#include <vector>

#include "io/atomic_file.h"

namespace dtsdf {

/// A file without a name, which goes with whoever has opened it.
class PlySpool {
 public:
  explicit PlySpool(const std::string& beside) : beside_(beside) {
    std::string name = beside + ".XXXXXX";
    const int descriptor = mkostemp(&name[0], O_CLOEXEC);
    if (descriptor < 0) fail();
    unlink(name.c_str());
    file_.reset(fdopen(descriptor, "w+b"));
    if (file_ == nullptr) {
      close(descriptor);
      fail();
    }
  }

  void write(const void* data, size_t bytes) {
    if (std::fwrite(data, 1, bytes, file_.get()) != bytes) fail();
  }

  void appendTo(AtomicFile& target) {
    if (std::fflush(file_.get()) != 0) fail();
    std::rewind(file_.get());
    std::vector<char> piece(1 << 20);
    for (;;) {
      const size_t got = std::fread(piece.data(), 1, piece.size(), file_.get());
      target.write(piece.data(), got);
      if (got < piece.size()) break;
    }
    if (std::ferror(file_.get()) != 0) fail();
  }

 private:
  [[noreturn]] void fail() const {
    throw std::runtime_error("cannot write '" + beside_ +
                             "': " + std::generic_category().message(errno) +
                             "; it needs space for the mesh twice: free some space or choose "
                             "another folder");
  }

  struct Close {
    // What is in it was read by now, or is not wanted.
    void operator()(std::FILE* open) const { static_cast<void>(std::fclose(open)); }
  };

  const std::string beside_;
  std::unique_ptr<std::FILE, Close> file_;
};

struct PlyStream::State {
  State(const std::string& target, MeshColour mesh_colour)
      : path(target), colour(mesh_colour), vertex_bytes(target), triangle_bytes(target) {}

  const std::string path;
  const MeshColour colour;
  PlySpool vertex_bytes, triangle_bytes;
  uint64_t vertices = 0, triangles = 0;
  bool is_far = false;
};

PlyStream::PlyStream(const std::string& path, MeshColour colour)
    : state_((prepareOutputFile(path), std::make_unique<State>(path, colour))) {}
PlyStream::~PlyStream() = default;

void PlyStream::addVertices(const Mesh& piece) {
  for (size_t i = 0; i < piece.vertices_m.size(); ++i) {
    writePlyVertex(piece, i, state_->colour, state_->vertex_bytes);
  }
  state_->is_far = isFarFromOrigin(piece);
  state_->vertices += piece.vertices_m.size();
}

void PlyStream::addTriangle(const std::array<uint32_t, 3>& triangle) {
  writePlyTriangle(triangle, state_->triangle_bytes);
  ++state_->triangles;
}

uint64_t PlyStream::vertices() const { return state_->vertices; }
uint64_t PlyStream::triangles() const { return state_->triangles; }

void PlyStream::finish() {
  checkMeshSize(state_->vertices, state_->triangles, state_->path);
  AtomicFile file(state_->path);
  file.write(plyHeader(state_->vertices, state_->triangles, state_->is_far));
  state_->vertex_bytes.appendTo(file);
  state_->triangle_bytes.appendTo(file);
  file.commit();
}

}  // namespace dtsdf
