/// Chunks of the mesh as objects of RViz's renderer: with shared vertices, and each on its own, so
/// that what is out of view costs nothing.
#pragma once

#include <OgreColourValue.h>
#include <OgreManualObject.h>
#include <OgreMaterial.h>
#include <OgreMaterialManager.h>
#include <OgreResourceGroupManager.h>
#include <OgreSceneManager.h>
#include <OgreSceneNode.h>
#include <OgreTechnique.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <map>
#include <string>
#include <utility>

#include "meshing/packed_chunk.h"

namespace dtsdf {

/// How chunks are shown.
struct ChunkStyle {
  MeshColour colour = MeshColour::kAuto;
  Ogre::ColourValue plain = Ogre::ColourValue(0.78f, 0.78f, 0.78f);  ///< Colour for kPlain.
  float alpha = 1.0f;
  bool backfaces = true;
  bool wireframe = false;
};

/// RViz's thread only.
class ChunkVisuals {
 public:
  /// Below a node, that of the map frame.
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
    for (const auto& [origin, visual] : visuals_) build(visual);
  }

  /// Adds a chunk, or replaces or removes the one with its origin.
  void put(PackedChunk chunk, double step_m) {
    const auto before = visuals_.find(chunk.origin);
    if (before != visuals_.end()) remove(before);
    if (chunk.triangleCount() == 0) return;
    triangles_ += chunk.triangleCount();
    // The node is where the chunk is, so that its vertices are small numbers, far away as well.
    const Ogre::Vector3 place(static_cast<float>(static_cast<double>(chunk.origin[0]) * step_m),
                              static_cast<float>(static_cast<double>(chunk.origin[1]) * step_m),
                              static_cast<float>(static_cast<double>(chunk.origin[2]) * step_m));
    Visual& visual = visuals_[chunk.origin];
    visual = {step_m, parent_.createChildSceneNode(place), manager_.createManualObject(),
              std::move(chunk)};
    visual.node->attachObject(visual.object);
    build(visual);
  }

  void clear() {
    while (!visuals_.empty()) remove(visuals_.begin());
  }

  size_t chunks() const { return visuals_.size(); }
  size_t triangles() const { return triangles_; }

 private:
  using Origin = std::array<int64_t, 3>;

  /// Materials have one name space for all displays.
  static std::string makeMaterialName() {
    static std::atomic<unsigned> count{0};
    return "dtsdf_mapping/mesh_blocks_" + std::to_string(count++);
  }

  struct Visual {
    double step_m;
    Ogre::SceneNode* node;
    Ogre::ManualObject* object;
    PackedChunk chunk;  ///< Kept for other colours to be made of it.
  };

  bool isLit() const { return style_.colour == MeshColour::kPlain; }
  /// As markers, colours are shown as they are; only one colour for all needs light to show shapes.
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

  void build(const Visual& visual) {
    visual.object->clear();
    visual.object->estimateVertexCount(visual.chunk.vertexCount());
    visual.object->estimateIndexCount(3 * visual.chunk.triangleCount());
    visual.object->begin(material_->getName(), Ogre::RenderOperation::OT_TRIANGLE_LIST);
    addVertices(visual);
    for (size_t i = 0; i < 3 * visual.chunk.triangleCount(); ++i) {
      visual.object->index(visual.chunk.corner(i));
    }
    visual.object->end();
  }

  /// Positions are steps times the length of one: floats, but of small numbers.
  void addVertices(const Visual& visual) {
    const PackedChunk& chunk = visual.chunk;
    const Mesh mesh = unpackChunk(chunk, visual.step_m);
    const auto step = static_cast<float>(visual.step_m);
    for (size_t i = 0; i < chunk.vertexCount(); ++i) {
      visual.object->position(step * chunk.positions[3 * i], step * chunk.positions[3 * i + 1],
                              step * chunk.positions[3 * i + 2]);
      if (isLit()) visual.object->normal(mesh.normals[i].x, mesh.normals[i].y, mesh.normals[i].z);
      Ogre::ColourValue colour = style_.plain;
      if (!isLit()) {
        const auto [red, green, blue] = vertexColour(style_.colour, mesh, i);
        colour = Ogre::ColourValue(red, green, blue) / 255.0f;
      }
      colour.a = style_.alpha;
      visual.object->colour(colour);
    }
  }

  void remove(std::map<Origin, Visual>::iterator it) {
    triangles_ -= it->second.chunk.triangleCount();
    manager_.destroyManualObject(it->second.object);
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
