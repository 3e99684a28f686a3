// Where the linked lists of a tile begin, and how much is in them.

// Index of the first element of each texel's list plus one; 0 for an empty list.
@group(0) @binding(9) var<storage, read_write> heads: array<atomic<u32>>;
// The number of pushed elements, with those that found no room; the number of nodes made from them;
// of surfaces, those left to pass raster_large, and a 256th of the elements, rounded up, which tells
// when their number exceeds 32 bits.
@group(0) @binding(11) var<storage, read_write> counters: array<atomic<u32>, 4>;
