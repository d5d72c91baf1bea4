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

  const std::string beside_;
  // Whatever closing it says: what is in it was read by now, or is not wanted.
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_{nullptr, &std::fclose};
};

PlyStream::PlyStream(const std::string& path, MeshColour colour)
    : path_((prepareOutputFile(path), path)),
      colour_(colour),
      vertex_bytes_(std::make_unique<PlySpool>(path)),
      triangle_bytes_(std::make_unique<PlySpool>(path)) {}
PlyStream::~PlyStream() = default;

void PlyStream::addVertices(const Mesh& piece) {
  for (size_t i = 0; i < piece.vertices_m.size(); ++i) {
    writePlyVertex(piece, i, colour_, *vertex_bytes_);
  }
  is_far_ = isFarFromOrigin(piece);
  vertices_ += piece.vertices_m.size();
}

void PlyStream::addTriangle(const std::array<uint32_t, 3>& triangle) {
  writePlyTriangle(triangle, *triangle_bytes_);
  ++triangles_;
}

void PlyStream::finish() {
  checkMeshSize(vertices_, triangles_, path_);
  AtomicFile file(path_);
  file.write(plyHeader(vertices_, triangles_, is_far_));
  vertex_bytes_->appendTo(file);
  triangle_bytes_->appendTo(file);
  file.commit();
}

}  // namespace dtsdf
