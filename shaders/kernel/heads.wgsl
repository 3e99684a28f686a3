// Where the linked lists of a tile begin, and how much is in them.

// Index of the first element of each texel's list plus one; 0 for an empty list.
@group(0) @binding(9) var<storage, read_write> heads: array<atomic<u32>>;
// The number of pushed elements, with those that found no room; the number of nodes made from them;
// the number of surfaces that one thread would take too long for; and, of passes that compute
// surfaces, a sum of 256ths of the elements, rounded up, which tells when there are more than 32 bits
// count.
@group(0) @binding(11) var<storage, read_write> counters: array<atomic<u32>, 4>;
