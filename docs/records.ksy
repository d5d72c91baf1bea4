meta:
  id: dtsdf_records
  title: Map files and journals of dtsdf_mapping
  file-extension: [dtsdf, dtsdfj]
  endian: le
doc: |
  A file of records, as docs/map_format.md describes them. Contents that are stored as a zstd frame
  (flag 1) are left as they are stored.
seq:
  - id: magic
    contents: DTSDFREC
  - id: version
    type: u4
    valid: 1
  - id: purpose
    type: str
    size: 4
    encoding: ASCII
  - id: records
    type: record
    repeat: eos
types:
  record:
    seq:
      - id: kind
        type: str
        size: 4
        encoding: ASCII
      - id: flags
        type: u4
      - id: stored_bytes
        type: u8
      - id: checksum
        type: u8
      - id: stored
        size: stored_bytes
        type:
          switch-on: 'is_zstd ? "zstd" : kind'
          cases:
            '"SETT"': text
            '"FRAM"': text
            '"LEVL"': pose
            '"STAT"': state
            '"END "': end
            '"BEGN"': begin
            '"DIMG"': image
            '"CIMG"': image
            '"TWM "': pose
    instances:
      is_zstd:
        value: (flags & 1) != 0
      may_be_skipped:
        value: (flags & 2) != 0
  text:
    seq:
      - id: value
        type: str
        size-eos: true
        encoding: UTF-8
  pose:
    doc: Three rows of four, rotation and translation.
    seq:
      - id: rows
        type: f8
        repeat: expr
        repeat-expr: 12
  short_text:
    seq:
      - id: bytes
        type: u4
      - id: value
        type: str
        size: bytes
        encoding: UTF-8
  begin:
    seq:
      - id: settings
        type: short_text
      - id: map_frame
        type: short_text
      - id: level_frame
        type: short_text
      - id: has_map
        type: u1
  image:
    doc: What follows in a depth image is its unit and the place whose surroundings are kept.
    seq:
      - id: stamp_s
        type: f8
      - id: camera
        type: u4
      - id: given_pose
        type: pose
      - id: fused_pose
        type: pose
      - id: encoding
        type: s4
      - id: width
        type: s4
      - id: height
        type: s4
      - id: intrinsics
        type: f4
        repeat: expr
        repeat-expr: 4
      - id: of_depth
        size-eos: true
  state:
    seq:
      - id: frames
        type: u8
      - id: supporting_frames
        type: u8
      - id: blocks
        type: u8
      - id: voxel_arrays
        type: u8
      - id: stamp_s
        type: f8
  end:
    seq:
      - id: records
        type: u8
      - id: head_hash
        type: u8
      - id: content_hash
        type: u8
      - id: chunk_checksums
        type: u8
        repeat: eos
