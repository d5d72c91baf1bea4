// The map of a session as a whole: copied, saved, replaced, emptied.
#include <utility>

#include "ros/session/map_session.h"

namespace dtsdf {

void MapSession::clear() {
  mapper_->clear();
  if (parts_.correction != nullptr) parts_.correction->giveUp("the map was emptied meanwhile");
  if (parts_.log != nullptr) parts_.log->emptied();
  if (parts_.poses != nullptr) parts_.poses->mapIsAnother();
  schedule_.cleared();
  mesh_whole_ = true;
  map_stamp_ = mesh_stamp_ = ros::Time();
  loaded_stamp_s_ = 0.0;
  forgetHandedOver();
  forgetFailure();
  updateReport();
}

MapContents MapSession::contents() { return contentsWith(origin(), *mapper_); }

SavedMap MapSession::save(const std::string& path, const std::string& map_frame) {
  return saveMapOf(*mapper_, origin(map_frame), path);
}

MapOrigin MapSession::origin(const std::string& map_frame) const {
  MapOrigin origin;
  origin.map_frame = map_frame;
  if (parts_.levelling != nullptr) origin.T_W_M = parts_.levelling->level();
  if (parts_.poses != nullptr) origin.poses = parts_.poses->params();
  origin.stamp_s = map_stamp_.isZero() ? loaded_stamp_s_ : map_stamp_.toSec();
  return origin;
}

bool MapSession::isEmpty() const {
  if (hasFailed()) return false;  // and asking could fail
  const MapStats stats = mapper_->stats();
  return stats.blocks + stats.pages.blocks == 0;
}

std::unique_ptr<Mapper> MapSession::replace(LoadedMap loaded) {
  mapper_.swap(loaded.mapper);
  const MapContents& head = *loaded.head;
  if (head.T_W_M && isLevelled()) parts_.levelling->set(*head.T_W_M);
  if (parts_.correction != nullptr) {
    parts_.correction->giveUp("another map was loaded meanwhile");
  }
  if (parts_.log != nullptr) parts_.log->loaded(head, std::move(loaded.write_map));
  if (parts_.poses != nullptr) parts_.poses->mapIsAnother();
  schedule_.mapReplaced();
  mesh_whole_ = true;
  map_stamp_ = mesh_stamp_ = ros::Time();
  loaded_stamp_s_ = head.stamp_s;
  forgetHandedOver(loaded.voxel_size_m);
  forgetFailure();
  updateReport();
  const std::lock_guard<std::mutex> lock(report_mutex_);
  report_.loaded_map = loaded.path;
  report_.voxel_size_m = loaded.voxel_size_m;
  return std::move(loaded.mapper);
}

/// So that nothing of the map that was here is on its way any more.
void MapSession::forgetHandedOver(std::optional<float> voxel_size_m) {
  parts_.mesh_changes.clear(voxel_size_m);
  surfaces_stamp_ = space_stamp_ = ros::Time();
  space_is_part_ = false;
  if (parts_.space != nullptr) parts_.space->clear();
}

}  // namespace dtsdf
