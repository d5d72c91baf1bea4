/// Chunks of the mesh as objects of RViz's renderer: with shared vertices, and each on its own, so
/// that what is out of view costs nothing.
#pragma once

#include <OgreAxisAlignedBox.h>
#include <OgreColourValue.h>
#include <OgreMaterial.h>

#include <array>
#include <cstdint>
#include <map>
#include <vector>

#include "meshing/packed_chunk.h"

namespace Ogre {
class Camera;
class ManualObject;
class SceneManager;
class SceneNode;
}  // namespace Ogre

namespace dtsdf {

/// How chunks are shown.
struct ChunkStyle {
  MeshColour colour = MeshColour::kAuto;
  Ogre::ColourValue plain = Ogre::ColourValue(0.78f, 0.78f, 0.78f);  ///< Of the colour kPlain.
  float alpha = 1.0f;
  bool backfaces = true;
  bool wireframe = false;
};

/// RViz's thread only.
class ChunkVisuals {
 public:
  /// Below a node, that of the map frame.
  ChunkVisuals(Ogre::SceneManager& manager, Ogre::SceneNode& parent);
  ~ChunkVisuals();
  ChunkVisuals(const ChunkVisuals&) = delete;
  ChunkVisuals& operator=(const ChunkVisuals&) = delete;

  void setStyle(const ChunkStyle& style);

  /// Adds a chunk, or replaces or removes the one with its origin.
  void put(PackedChunk chunk, double step_m);
  void clear();

  /// Draws of each chunk the coarsest level whose cells are at most so many pixels as a camera sees
  /// them; 0: whole chunks.
  void chooseLevels(const Ogre::Camera& camera, float detail_px);

  size_t chunks() const { return visuals_.size(); }
  size_t triangles() const { return triangles_; }

 private:
  using Origin = std::array<int64_t, 3>;

  /// The whole chunk and coarser ones, of which one is drawn. They are kept for other colours to be
  /// made of them.
  struct Level {
    PackedChunk chunk;
    Ogre::ManualObject* object;
    float cell_m;  ///< How coarse; 0: the whole chunk.
  };
  struct Visual {
    double step_m;
    Ogre::SceneNode* node;
    Ogre::Vector3 centre;  ///< In the map frame.
    float radius_m;
    std::vector<Level> levels;
  };

  bool isLit() const { return style_.colour == MeshColour::kPlain; }
  void applyMaterial();
  void addLevel(Visual& visual, PackedChunk chunk, float cell_m);
  void build(const Level& level, double step_m);
  void addVertices(const Level& level, double step_m);
  void remove(std::map<Origin, Visual>::iterator it);

  Ogre::SceneManager& manager_;
  Ogre::SceneNode& parent_;
  Ogre::MaterialPtr material_;
  ChunkStyle style_;
  std::map<Origin, Visual> visuals_;
  size_t triangles_ = 0;
};

}  // namespace dtsdf
