/// Draws each mesh chunk in RViz as its own object, so that Ogre culls chunks out of view.
#pragma once

#include <OgreAxisAlignedBox.h>
#include <OgreCamera.h>
#include <OgreColourValue.h>
#include <OgreManualObject.h>
#include <OgreMaterial.h>
#include <OgreMaterialManager.h>
#include <OgreResourceGroupManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>
#include <OgreViewport.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "meshing/packed_chunk.h"

namespace dtsdf {

/// Appearance of the chunks.
struct ChunkStyle {
  MeshColour colour = MeshColour::kAuto;
  Ogre::ColourValue plain = Ogre::ColourValue(0.78f, 0.78f, 0.78f);  ///< Colour for kPlain.
  float alpha = 1.0f;
  bool backfaces = true;
  bool wireframe = false;
};

/// Used on RViz's main thread only.
class ChunkVisuals {
 public:
  /// `parent` is the scene node of the map frame.
  ChunkVisuals(Ogre::SceneManager& manager, Ogre::SceneNode& parent)
      : manager_(manager),
        parent_(parent),
        material_(Ogre::MaterialManager::getSingleton().create(
            makeMaterialName(), Ogre::ResourceGroupManager::DEFAULT_RESOURCE_GROUP_NAME)) {
    material_->setReceiveShadows(false);
    applyMaterial();
  }

  ~ChunkVisuals() {
    clear();
    Ogre::MaterialManager::getSingleton().remove(material_->getName());
  }

  ChunkVisuals(const ChunkVisuals&) = delete;
  ChunkVisuals& operator=(const ChunkVisuals&) = delete;

  void setStyle(const ChunkStyle& style) {
    const bool is_other_colour =
        style.colour != style_.colour || style.plain != style_.plain || style.alpha != style_.alpha;
    style_ = style;
    applyMaterial();
    if (!is_other_colour) return;
    for (auto& [origin, visual] : visuals_) {
      for (const Level& level : visual.levels) build(level, visual);
    }
  }

  /// Adds a chunk, replacing any chunk with the same origin. An empty chunk only removes it.
  void put(PackedChunk chunk, double step_m) {
    const auto before = visuals_.find(chunk.origin);
    if (before != visuals_.end()) remove(before);
    if (chunk.triangleCount() == 0) return;
    triangles_ += chunk.triangleCount();
    // The scene node is at the chunk's origin, so that floats suffice for vertices even far from
    // the map's origin.
    std::array<double, 3> origin_m;
    Ogre::Vector3 place;
    for (int axis = 0; axis < 3; ++axis) {
      origin_m[axis] = static_cast<double>(chunk.origin[axis]) * step_m;
      place[axis] = static_cast<float>(origin_m[axis]);
    }
    Visual& visual = visuals_[chunk.origin];
    visual = {origin_m, parent_.createChildSceneNode(place), place, 0.0f, {}};
    addLevel(visual, std::move(chunk), step_m);
    const Ogre::AxisAlignedBox& box = visual.levels[0].object->getBoundingBox();
    visual.centre = place + box.getCenter();
    visual.radius_m = 0.5f * box.getSize().length();
    for (int level = 1; level <= kCoarseLevels; ++level) {
      const int cell_log2 = kFinestCellLog2 + level - 1;
      PackedChunk coarse = coarsen(visual.levels[0].chunk, cell_log2);
      if (coarse.triangleCount() == 0) break;
      addLevel(visual, std::move(coarse), step_m * (1 << cell_log2) / 4);
    }
  }

  void clear() {
    while (!visuals_.empty()) remove(visuals_.begin());
  }

  /// Draws each chunk at the coarsest level of detail whose cells cover at most `detail_px` pixels
  /// in the camera's view, or in full detail if there is no such level.
  void chooseLevels(const Ogre::Camera& camera, float detail_px) {
    const Ogre::Vector3 eye = parent_._getFullTransform().inverse() * camera.getDerivedPosition();
    const auto height_px = static_cast<float>(camera.getViewport()->getActualHeight());
    const bool is_orthographic = camera.getProjectionType() == Ogre::PT_ORTHOGRAPHIC;
    // Height of the view in m; for a perspective camera, at a distance of 1 m.
    const float view_height = is_orthographic
                                  ? camera.getOrthoWindowHeight()
                                  : 2.0f * std::tan(0.5f * camera.getFOVy().valueRadians());
    for (auto& [origin, visual] : visuals_) {
      // 0 if the camera may be inside the chunk. A perspective view then shows the chunk in full
      // detail.
      const float distance_m = std::max(eye.distance(visual.centre) - visual.radius_m, 0.0f);
      const float width_m = is_orthographic ? view_height : view_height * distance_m;
      const float coarsest_m = detail_px * width_m / height_px;
      size_t chosen = 0;
      double cell_m = visual.levels[0].step_m * (1 << kFinestCellLog2);
      for (; chosen + 1 < visual.levels.size() && cell_m <= coarsest_m; ++chosen) cell_m *= 2.0;
      for (size_t i = 0; i < visual.levels.size(); ++i) {
        visual.levels[i].object->setVisible(i == chosen);
      }
    }
  }

  size_t chunks() const { return visuals_.size(); }
  size_t triangles() const { return triangles_; }

 private:
  using Origin = std::array<int64_t, 3>;

  /// If a voxel has 512 steps (see ChunkLattice), the cells of the coarse levels are 2, 4, 8 and 16
  /// voxels wide.
  static constexpr int kCoarseLevels = 4;
  static constexpr int kFinestCellLog2 = 10;

  /// Material names must be unique, because Ogre shares materials between all displays.
  static std::string makeMaterialName() {
    static std::atomic<unsigned> count{0};
    return "dtsdf_mapping/mesh_blocks_" + std::to_string(count++);
  }

  /// A chunk, in full or reduced detail, and the Ogre object that draws it. The chunk is kept so
  /// that the object can be rebuilt if colours change.
  struct Level {
    PackedChunk chunk;
    double step_m;
    Ogre::ManualObject* object;
  };
  struct Visual {
    std::array<double, 3> origin_m;
    Ogre::SceneNode* node;
    Ogre::Vector3 centre;  ///< In the map frame.
    float radius_m;
    std::vector<Level> levels;
  };

  bool isLit() const { return style_.colour == MeshColour::kPlain; }
  /// Vertex colours are unlit, as in markers; a plain colour needs light to show shapes.
  void applyMaterial() {
    Ogre::Pass& pass = *material_->getTechnique(0)->getPass(0);
    pass.setLightingEnabled(isLit());
    pass.setVertexColourTracking(Ogre::TVC_AMBIENT | Ogre::TVC_DIFFUSE);
    pass.setCullingMode(style_.backfaces ? Ogre::CULL_NONE : Ogre::CULL_CLOCKWISE);
    pass.setPolygonMode(style_.wireframe ? Ogre::PM_WIREFRAME : Ogre::PM_SOLID);
    const bool is_opaque = style_.alpha >= 1.0f;
    pass.setSceneBlending(is_opaque ? Ogre::SBT_REPLACE : Ogre::SBT_TRANSPARENT_ALPHA);
    pass.setDepthWriteEnabled(is_opaque);
  }

  void addLevel(Visual& visual, PackedChunk chunk, double step_m) {
    Ogre::ManualObject* const object = manager_.createManualObject();
    visual.node->attachObject(object);
    object->setVisible(visual.levels.empty());
    visual.levels.push_back({std::move(chunk), step_m, object});
    build(visual.levels.back(), visual);
  }

  void build(const Level& level, const Visual& visual) {
    const auto& [chunk, step_m, object] = level;
    object->clear();
    object->estimateVertexCount(chunk.vertexCount());
    object->estimateIndexCount(3 * chunk.triangleCount());
    object->begin(material_->getName(), Ogre::RenderOperation::OT_TRIANGLE_LIST);
    addVertices(unpackChunk(chunk, step_m), visual.origin_m, *object);
    for (size_t i = 0; i < 3 * chunk.triangleCount(); ++i) object->index(chunk.corner(i));
    object->end();
  }

  void addVertices(const Mesh& mesh, const std::array<double, 3>& origin_m,
                   Ogre::ManualObject& object) {
    Ogre::Vector3 shift;
    for (int axis = 0; axis < 3; ++axis) {
      shift[axis] = static_cast<float>(mesh.origin_m[axis] - origin_m[axis]);
    }
    for (size_t i = 0; i < mesh.vertices_m.size(); ++i) {
      const Vec3f& p = mesh.vertices_m[i];
      object.position(shift + Ogre::Vector3(p.x, p.y, p.z));
      if (isLit()) object.normal(mesh.normals[i].x, mesh.normals[i].y, mesh.normals[i].z);
      Ogre::ColourValue colour = style_.plain;
      if (!isLit()) {
        const auto [red, green, blue] = vertexColour(style_.colour, mesh, i);
        colour = Ogre::ColourValue(red, green, blue) / 255.0f;
      }
      colour.a = style_.alpha;
      object.colour(colour);
    }
  }

  void remove(std::map<Origin, Visual>::iterator it) {
    triangles_ -= it->second.levels[0].chunk.triangleCount();
    for (const Level& level : it->second.levels) manager_.destroyManualObject(level.object);
    manager_.destroySceneNode(it->second.node);
    visuals_.erase(it);
  }

  Ogre::SceneManager& manager_;
  Ogre::SceneNode& parent_;
  Ogre::MaterialPtr material_;
  ChunkStyle style_;
  std::map<Origin, Visual> visuals_;
  size_t triangles_ = 0;
};

}  // namespace dtsdf
