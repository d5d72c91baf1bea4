/// Shows the topic mesh_blocks in RViz.
#pragma once

#include <OgreAxisAlignedBox.h>
#include <OgreQuaternion.h>
#include <dtsdf_mapping/MeshBlocks.h>
#include <ros/subscriber.h>
#include <rviz/display.h>

#include <memory>
#include <string>

namespace Ogre {
class Camera;
}

namespace rviz {
class BoolProperty;
class ColorProperty;
class EnumProperty;
class FloatProperty;
class RosTopicProperty;
}  // namespace rviz

namespace dtsdf {

class ChunkVisuals;

class MeshBlocksDisplay : public rviz::Display {
  Q_OBJECT
 public:
  MeshBlocksDisplay();
  ~MeshBlocksDisplay() override;

  void setTopic(const QString& topic, const QString& datatype) override;

 protected:
  void onInitialize() override;
  void onEnable() override;
  void onDisable() override;
  void fixedFrameChanged() override;
  void update(float wall_dt, float ros_dt) override;
  void reset() override;

 private Q_SLOTS:
  void updateTopic();
  void updateStyle();

 private:
  void subscribe();
  void unsubscribe();
  void onBlocks(const dtsdf_mapping::MeshBlocks::ConstPtr& message);
  void showCount();
  void placeMap();
  bool isTurning(const Ogre::Camera& camera, float wall_dt);

  rviz::RosTopicProperty* topic_;
  rviz::EnumProperty* colour_;
  rviz::ColorProperty* plain_;
  rviz::FloatProperty* alpha_;
  rviz::BoolProperty* backfaces_;
  rviz::BoolProperty* wireframe_;
  rviz::FloatProperty* detail_;

  ros::Subscriber subscriber_;
  std::unique_ptr<ChunkVisuals> visuals_;
  std::string frame_;  ///< Of the map; empty before the first message.

  Ogre::Vector3 eye_ = Ogre::Vector3::ZERO;  ///< Of the last picture, as the way it looks.
  Ogre::Quaternion looks_ = Ogre::Quaternion::IDENTITY;
  float still_s_ = 0.0f;  ///< Since the view has not changed.
};

}  // namespace dtsdf
