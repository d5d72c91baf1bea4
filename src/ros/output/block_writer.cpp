#include <dtsdf_mapping/MeshBlocks.h>
#include <ros/serialization.h>

#include <utility>

#include "ros/common/chunk_message.h"
#include "ros/output/chunk_writer.h"

namespace dtsdf {
namespace {

using dtsdf_mapping::MeshBlocks;

class BlockWriter : public ChunkWriter {
 public:
  explicit BlockWriter(std::string map_frame) : map_frame_(std::move(map_frame)) {}

  ros::AdvertiseOptions advertiseOptions() const override {
    ros::AdvertiseOptions options;
    options.init<MeshBlocks>("mesh_blocks", 1);
    return options;
  }

  void begin(bool anew, double step_m, const ros::Time& stamp) override {
    message_ = MeshBlocks();
    message_.header.frame_id = map_frame_;
    message_.header.stamp = stamp;
    message_.begins_anew = anew;
    message_.step_m = step_m;
    bytes_ = ros::serialization::serializationLength(message_);
  }

  void add(PackedChunk chunk, int) override {
    bytes_ += bytesInMessage(chunk);
    message_.blocks.push_back(toMessage(std::move(chunk)));
  }

  size_t bytes() const override { return bytes_; }

  ros::SerializedMessage finish() override {
    return ros::serialization::serializeMessage(message_);
  }

 private:
  std::string map_frame_;
  MeshBlocks message_;
  size_t bytes_ = 0;
};

}  // namespace

std::unique_ptr<ChunkWriter> makeBlockWriter(const std::string& map_frame) {
  return std::make_unique<BlockWriter>(map_frame);
}

}  // namespace dtsdf
