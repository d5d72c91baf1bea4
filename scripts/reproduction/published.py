"""Figures to compare with: the paper's, those of its authors' code, of nvblox, and the floor.

Paper: Splietker and Behnke, "Directional TSDF: Modeling Surface Orientation for Coherent Meshes",
IROS 2019, Tables I and III and the figure of update times. The others were measured with the
paper's set-up (1000 frames, truncation of 4 voxels) on the models that this script uses: the
authors' released code, nvblox v0.0.5 with constant uncapped weights, and, as the floor of an
undirected grid, exact signed distances of the model with plain marching cubes.

Triples are vertex, surface and completeness RMSE in mm, keyed by (model, voxel size in mm).
"""

# Vertex RMSE, (directional, undirected voxel projection).
PAPER_TABLE_1 = {
    ("armadillo", 5): (1.14, 1.55), ("armadillo", 10): (1.74, 3.67),
    ("armadillo", 20): (3.58, 11.83), ("armadillo", 30): (6.53, 25.27),
    ("armadillo", 40): (14.56, 41.02), ("armadillo", 50): (21.39, 58.36),
    ("asian_dragon", 5): (1.56, 2.34), ("asian_dragon", 10): (2.87, 7.11),
    ("asian_dragon", 20): (6.81, 19.94), ("asian_dragon", 30): (11.90, 38.70),
    ("asian_dragon", 40): (19.00, 55.17), ("asian_dragon", 50): (30.74, 67.86),
    ("bunny", 5): (0.98, 1.90), ("bunny", 10): (1.23, 3.82), ("bunny", 20): (2.18, 9.01),
    ("bunny", 30): (4.17, 17.70), ("bunny", 40): (8.59, 27.97), ("bunny", 50): (18.37, 37.98),
    ("dragon", 5): (1.23, 1.73), ("dragon", 10): (2.15, 4.44), ("dragon", 20): (5.35, 12.09),
    ("dragon", 30): (8.99, 22.40), ("dragon", 40): (11.70, 35.93), ("dragon", 50): (18.70, 52.67),
}

# Vertex RMSE at 10 mm, by model and mode.
PAPER_TABLE_3 = {
    "armadillo": {"undirected-vp": 3.670, "undirected-rc": 4.915, "undirected-rcn": 4.839,
                  "directional-vp": 1.931, "directional-rc": 2.478, "directional-rcn": 1.741},
    "asian_dragon": {"undirected-vp": 7.106, "undirected-rc": 10.148, "undirected-rcn": 9.211,
                     "directional-vp": 3.016, "directional-rc": 3.545, "directional-rcn": 2.865},
    "bunny": {"undirected-vp": 3.816, "undirected-rc": 2.792, "undirected-rcn": 2.958,
              "directional-vp": 1.625, "directional-rc": 1.674, "directional-rcn": 1.229},
    "dragon": {"undirected-vp": 4.438, "undirected-rc": 6.570, "undirected-rcn": 6.169,
               "directional-vp": 2.534, "directional-rc": 2.930, "directional-rcn": 2.146},
}

# Total update time in ms and the share of meshing in it, Asian Dragon, on a GTX 960M.
PAPER_TIMES = {
    "undirected-vp": {5: (112.4, 0.97), 10: (30.9, 0.90), 20: (10.7, 0.74), 30: (7.5, 0.62),
                      40: (6.4, 0.48), 50: (5.2, 0.46)},
    "directional-rcn": {5: (199.0, 0.97), 10: (74.0, 0.93), 20: (31.7, 0.85), 30: (19.9, 0.76),
                        40: (15.1, 0.69), 50: (13.0, 0.64)},
}

FLOOR = {
    ("armadillo", 5): (0.08, 0.21, 0.22), ("armadillo", 10): (0.25, 0.66, 0.72),
    ("armadillo", 20): (0.76, 1.76, 2.33), ("armadillo", 50): (2.83, 5.79, 12.3),
    ("asian_dragon", 5): (0.15, 0.37, 0.47), ("asian_dragon", 10): (0.44, 0.98, 1.34),
    ("asian_dragon", 20): (1.22, 2.39, 5.73), ("asian_dragon", 50): (3.31, 6.20, 18.6),
    ("bunny", 5): (0.05, 0.12, 0.12), ("bunny", 10): (0.13, 0.33, 0.36),
    ("bunny", 20): (0.39, 1.04, 1.13), ("bunny", 50): (2.14, 4.85, 6.96),
    ("dragon", 5): (0.07, 0.19, 0.25), ("dragon", 10): (0.24, 0.63, 0.83),
    ("dragon", 20): (0.81, 1.81, 2.90), ("dragon", 50): (3.38, 6.34, 13.2),
}

# The authors' released code, by mode.
AUTHORS_CODE = {
    "undirected-vp": {
        ("armadillo", 5): (1.30, 0.95, 1.01), ("armadillo", 10): (3.75, 3.10, 3.27),
        ("armadillo", 20): (12.3, 9.88, 8.42), ("armadillo", 50): (58.5, 53.5, 40.6),
        ("asian_dragon", 5): (2.01, 1.75, 1.72), ("asian_dragon", 10): (7.28, 6.26, 5.21),
        ("asian_dragon", 20): (21.1, 18.4, 12.6), ("asian_dragon", 50): (72.5, 64.2, 46.6),
        ("bunny", 5): (1.49, 0.95, 0.93), ("bunny", 10): (3.52, 2.41, 2.44),
        ("bunny", 20): (9.35, 7.13, 6.91), ("bunny", 50): (42.6, 36.9, 28.5),
        ("dragon", 5): (1.30, 1.03, 1.10), ("dragon", 10): (4.17, 3.58, 3.50),
        ("dragon", 20): (12.3, 10.7, 10.2), ("dragon", 50): (50.8, 43.7, 44.5),
    },
    "directional-rcn": {
        ("armadillo", 5): (0.50, 0.46, 0.84), ("armadillo", 10): (1.42, 1.26, 1.83),
        ("armadillo", 20): (4.01, 2.78, 3.18), ("armadillo", 50): (20.4, 13.6, 11.6),
        ("asian_dragon", 5): (1.04, 0.89, 1.56), ("asian_dragon", 10): (2.52, 2.06, 3.09),
        ("asian_dragon", 20): (6.98, 5.10, 6.34), ("asian_dragon", 50): (31.5, 19.0, 25.3),
        ("bunny", 5): (0.27, 0.22, 0.68), ("bunny", 10): (0.71, 0.52, 0.87),
        ("bunny", 20): (2.07, 1.53, 1.66), ("bunny", 50): (13.5, 9.34, 9.81),
        ("dragon", 5): (0.57, 0.46, 1.28), ("dragon", 10): (1.86, 1.54, 2.02),
        ("dragon", 20): (4.70, 4.08, 6.01), ("dragon", 50): (16.9, 14.2, 21.4),
    },
}

NVBLOX = {
    ("armadillo", 5): (0.97, 0.98, 1.09), ("armadillo", 10): (3.01, 2.97, 2.99),
    ("armadillo", 20): (9.90, 9.62, 7.97), ("armadillo", 50): (51.4, 50.5, 36.9),
    ("asian_dragon", 5): (1.62, 1.58, 1.61), ("asian_dragon", 10): (6.00, 5.69, 4.59),
    ("asian_dragon", 20): (17.2, 16.5, 10.6), ("asian_dragon", 50): (69.1, 67.8, 40.1),
    ("bunny", 5): (1.12, 1.14, 0.89), ("bunny", 10): (2.48, 2.44, 1.99),
    ("bunny", 20): (6.95, 6.73, 6.47), ("bunny", 50): (37.5, 37.5, 25.5),
    ("dragon", 5): (1.11, 1.10, 1.20), ("dragon", 10): (3.49, 3.35, 3.18),
    ("dragon", 20): (9.95, 9.78, 10.3), ("dragon", 50): (45.5, 43.3, 44.1),
}

# (boundary edges, components) of the authors' directional meshes.
AUTHORS_TOPOLOGY = {
    ("armadillo", 10): (1033, 2), ("asian_dragon", 10): (1348, 21),
    ("bunny", 10): (782, 2), ("dragon", 10): (1976, 10),
}

# ms for integration and for meshing after every frame, Asian Dragon, on an H200.
AUTHORS_TIMES = {
    "undirected-vp": {5: (0.59, 1.59), 10: (0.59, 0.73), 20: (0.54, 0.60), 50: (0.54, 0.54)},
    "directional-rcn": {5: (0.89, 2.96), 10: (0.86, 1.83), 20: (0.86, 1.66), 50: (0.78, 1.55)},
}

# house_noisy: surface RMSE, completeness RMSE in mm, F-score at 25 mm; None: not measured.
NVBLOX_HOUSE = {25: (7.28, 5.66, 0.989), 50: (15.2, 12.0, 0.967)}
AUTHORS_HOUSE = {25: (None, None, 0.42), 50: (None, None, 0.44)}
