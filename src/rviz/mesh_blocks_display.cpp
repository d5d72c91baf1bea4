/// Shows the topic mesh_blocks in RViz.
#include <OgreCamera.h>
#include <OgreSceneNode.h>
#include <dtsdf_mapping/MeshBlocks.h>
#include <ros/message_traits.h>
#include <ros/subscriber.h>
#include <rviz/display.h>
#include <rviz/display_context.h>
#include <rviz/frame_manager.h>
#include <rviz/properties/bool_property.h>
#include <rviz/properties/color_property.h>
#include <rviz/properties/enum_property.h>
#include <rviz/properties/float_property.h>
#include <rviz/properties/ros_topic_property.h>
#include <rviz/view_controller.h>
#include <rviz/view_manager.h>
#include <pluginlib/class_list_macros.hpp>

#include <exception>
#include <memory>
#include <string>

#include "ros/common/chunk_message.h"
#include "rviz/chunk_visuals.h"

namespace dtsdf {

using dtsdf_mapping::MeshBlock;
using dtsdf_mapping::MeshBlocks;
using rviz::StatusProperty;

namespace {

/// Maximum number of messages queued while RViz renders. None may be lost, because each holds only
/// changes.
constexpr uint32_t kQueue = 1000;

constexpr char kTopicStatus[] = "Topic";
constexpr char kMeshStatus[] = "Mesh";
constexpr char kFrameStatus[] = "Transform";

}  // namespace

class MeshBlocksDisplay : public rviz::Display {
  Q_OBJECT
 public:
  MeshBlocksDisplay() {
    const auto datatype = QString::fromStdString(ros::message_traits::datatype<MeshBlocks>());
    topic_ = new rviz::RosTopicProperty("Topic", "", datatype, "Topic of type " + datatype + ".",
                                        this, SLOT(updateTopic()));
    colour_ = new rviz::EnumProperty("Colour", "Auto",
                                     "Auto: Image for chunks with colours, else Normal.", this,
                                     SLOT(updateStyle()));
    colour_->addOption("Auto", static_cast<int>(MeshColour::kAuto));
    colour_->addOption("Image", static_cast<int>(MeshColour::kImage));
    colour_->addOption("Normal", static_cast<int>(MeshColour::kNormal));
    colour_->addOption("Height", static_cast<int>(MeshColour::kHeight));
    colour_->addOption("Plain", static_cast<int>(MeshColour::kPlain));
    plain_ = new rviz::ColorProperty("Plain colour", QColor(200, 200, 200),
                                     "Colour of the mesh if Colour is Plain.", this,
                                     SLOT(updateStyle()));
    alpha_ = new rviz::FloatProperty("Alpha", 1.0f, "0: transparent, 1: opaque.", this,
                                     SLOT(updateStyle()));
    alpha_->setMin(0.0f);
    alpha_->setMax(1.0f);
    backfaces_ =
        new rviz::BoolProperty("Backfaces", true, "Also show surfaces from behind. Faster if off.",
                               this, SLOT(updateStyle()));
    wireframe_ = new rviz::BoolProperty("Wireframe", false, "Show only the edges of triangles.",
                                        this, SLOT(updateStyle()));
    detail_ =
        new rviz::FloatProperty("Detail", 2.0f,
                                "Distant parts are drawn with coarser triangles, up to this many "
                                "pixels wide; 0 draws everything in full detail.",
                                this);
    detail_->setMin(0.0f);
    detail_->setMax(20.0f);
  }

  ~MeshBlocksDisplay() override { unsubscribe(); }

  void setTopic(const QString& topic, const QString&) override { topic_->setString(topic); }

 protected:
  void onInitialize() override {
    visuals_ = std::make_unique<ChunkVisuals>(*scene_manager_, *scene_node_);
    updateStyle();
  }

  void onEnable() override { subscribe(); }

  void onDisable() override {
    unsubscribe();
    visuals_->clear();
  }

  void fixedFrameChanged() override { placeMap(); }

  void update(float, float) override {
    placeMap();
    const rviz::ViewController* const view = context_->getViewManager()->getCurrent();
    if (view != nullptr) visuals_->chooseLevels(*view->getCamera(), detail_->getFloat());
  }

  /// Subscribes again, to get the whole mesh.
  void reset() override {
    rviz::Display::reset();
    updateTopic();
  }

 private Q_SLOTS:
  void updateTopic() {
    unsubscribe();
    if (visuals_) visuals_->clear();
    frame_.clear();
    if (isEnabled()) subscribe();
  }

  void updateStyle() {
    if (!visuals_) return;
    ChunkStyle style;
    style.colour = static_cast<MeshColour>(colour_->getOptionInt());
    style.plain = plain_->getOgreColor();
    style.alpha = alpha_->getFloat();
    style.backfaces = backfaces_->getBool();
    style.wireframe = wireframe_->getBool();
    plain_->setHidden(style.colour != MeshColour::kPlain);
    visuals_->setStyle(style);
    context_->queueRender();
  }

 private:
  void subscribe() {
    if (topic_->getTopicStd().empty()) return;
    try {
      subscriber_ =
          update_nh_.subscribe(topic_->getTopicStd(), kQueue, &MeshBlocksDisplay::onBlocks, this);
      setStatus(StatusProperty::Warn, kTopicStatus, "nothing received yet");
    } catch (const ros::Exception& error) {
      setStatus(StatusProperty::Error, kTopicStatus, error.what());
    }
  }

  void unsubscribe() { subscriber_.shutdown(); }

  void onBlocks(const MeshBlocks::ConstPtr& message) {
    try {
      checkStep(message->step_m);
      if (message->begins_anew) visuals_->clear();
      for (const MeshBlock& block : message->blocks) visuals_->put(toChunk(block), message->step_m);
      setStatus(StatusProperty::Ok, kTopicStatus, "OK");
    } catch (const std::exception& error) {
      setStatus(StatusProperty::Error, kTopicStatus, error.what());
    }
    frame_ = message->header.frame_id;
    placeMap();
    showCount();
    context_->queueRender();
  }

  void showCount() {
    setStatus(StatusProperty::Ok, kMeshStatus,
              QString("%1 triangles in %2 chunks")
                  .arg(static_cast<qulonglong>(visuals_->triangles()))
                  .arg(static_cast<qulonglong>(visuals_->chunks())));
  }

  void placeMap() {
    if (frame_.empty()) return;
    Ogre::Vector3 position;
    Ogre::Quaternion orientation;
    if (context_->getFrameManager()->getTransform(frame_, ros::Time(), position, orientation)) {
      scene_node_->setPosition(position);
      scene_node_->setOrientation(orientation);
      setStatus(StatusProperty::Ok, kFrameStatus, "OK");
    } else {
      setStatus(StatusProperty::Error, kFrameStatus,
                QString("no transform from '%1' to '%2'")
                    .arg(QString::fromStdString(frame_), fixed_frame_));
    }
  }

  rviz::RosTopicProperty* topic_;
  rviz::EnumProperty* colour_;
  rviz::ColorProperty* plain_;
  rviz::FloatProperty* alpha_;
  rviz::BoolProperty* backfaces_;
  rviz::BoolProperty* wireframe_;
  rviz::FloatProperty* detail_;

  ros::Subscriber subscriber_;
  std::unique_ptr<ChunkVisuals> visuals_;
  std::string frame_;  ///< Frame of the map; empty before the first message.
};

}  // namespace dtsdf

PLUGINLIB_EXPORT_CLASS(dtsdf::MeshBlocksDisplay, rviz::Display)
#include "mesh_blocks_display.moc"
