/* Counts the reference's colours in boxes, straight from a BGR picture, and tells how far they are from it.
 *
 * A pixel has a joint index: from three tables, one a channel of the picture, or from its hue; and a joint index has
 * the codes that such a pixel counts for, one a histogram. Every pixel of a box is counted from an integral image
 * (Porikli 2005) whose entries hold all counters side by side, as narrow as the largest box allows: they wrap, the
 * differences do not. Where the boxes are so far apart that this is more work, their pixels are visited instead;
 * and a grid of samples always is.
 */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#define DIRECT 1.0 /* Visiting a pixel, against an entry of an integral image. */

typedef struct {
    const uint8_t *pixels; /* blue, green, red */
    int64_t stride;        /* bytes from a row to the next */
    int32_t height, width;
    const uint16_t *index; /* three tables of 256: joint index = index[b] + index[256 + g] + index[512 + r], or */
    int32_t hue_bins;      /* if above 0, the bin of the hue, as nodes/vision/color.py has it */
    int32_t grey_chroma, grey_saturation, full_saturation;
} picture;

typedef struct {
    int32_t parts, codes, joints, channels;
    const int32_t *first;  /* (parts + 1): part p has the codes from first[p] to first[p + 1] - 1 */
    const double *edges;   /* (parts + 1): where the parts begin and end, 0 to 1 */
    const uint16_t *table; /* (parts, joints, channels): the codes that a pixel counts for; `codes` is none */
    const double *scale;   /* (codes): what the root of a count is worth */
    const double *perfect; /* (parts): the most that a part can contribute */
    const double *roots;   /* (known_roots): of the whole numbers from 0 on; looking up is faster than working out */
    int32_t known_roots;
} reference;

typedef struct {
    int32_t columns, rows; /* of the grid; 0 counts every pixel */
    const double *x, *y;   /* (columns), (rows): where its samples lie, 0 to 1 */
    const int32_t *part;   /* (rows): the part of each row */
} sampling;

/* Without branches, so that a row of pixels is done several at a time. */
static inline int hue_bin(int b, int g, int r, int bins, int grey_chroma, int grey_saturation, int full) {
    int largest = b > g ? b : g, least = b < g ? b : g;
    largest = largest > r ? largest : r;
    least = least < r ? least : r;
    int chroma = largest - least, n = bins - 1;
    int grey = (chroma < grey_chroma) | (full * chroma < grey_saturation * largest);
    int hue = largest == r ? g - b : largest == g ? 2 * chroma + b - r : 4 * chroma + r - g;
    hue += hue < 0 ? 6 * chroma : 0;
    /* whole numbers below 2^24: the floor is exact */
    int sector = (int)((float)(n * hue) / (float)(6 * chroma + (chroma == 0)));
    return grey ? n : sector;
}

static void index_row(const picture *p, const uint8_t *restrict bgr, int w, uint16_t *restrict joint) {
    const uint16_t *restrict blue = p->index, *restrict green = blue + 256, *restrict red = green + 256;
    const int bins = p->hue_bins, chroma = p->grey_chroma, saturation = p->grey_saturation;
    const int full = p->full_saturation;
    if (bins)
        for (int x = 0; x < w; x++)
            joint[x] = hue_bin(bgr[3 * x], bgr[3 * x + 1], bgr[3 * x + 2], bins, chroma, saturation, full);
    else
        for (int x = 0; x < w; x++) joint[x] = blue[bgr[3 * x]] + green[bgr[3 * x + 1]] + red[bgr[3 * x + 2]];
}

/* The pixel of a coordinate: within 0 and size; nowhere for NaN. */
static int cell(double coordinate, int size) {
    double c = floor(coordinate);
    return !(c > 0) ? 0 : c > size ? size : (int)c;
}

/* left, right and, for each part, where it begins and ends, in whole pixels whose centres lie inside. */
static void cells_of(const picture *p, const reference *r, const double *box, int *cells) {
    int nowhere = isnan(box[0]) || isnan(box[1]) || isnan(box[2]) || isnan(box[3]);
    cells[0] = nowhere ? 0 : cell(box[0] + 0.5, p->width);
    cells[1] = nowhere ? 0 : cell(box[2] + 0.5, p->width);
    for (int part = 0; part <= r->parts; part++)
        cells[2 + part] = nowhere ? 0 : cell(box[1] + r->edges[part] * (box[3] - box[1]) + 0.5, p->height);
}

/* The part of the picture that the boxes of one part of the target cover, and the boxes there by their edges. */
typedef struct {
    const uint16_t *joint; /* (h, w) */
    int h, w, n;
    const int *sides;  /* (n, 2): left and right of the boxes, from the region's left side */
    const int *events; /* (2 n): 2 i where box i begins and 2 i + 1 where it ends, in the order of the rows */
    const int *rows;   /* (h + 2): the first event of each row, from the region's top */
} region;

/* k codes of a part from `begin` on, by the last row of an integral image whose entries are LANES counters in one
 * vector (GCC's and Clang's): that row alone stays in the nearest cache. What a box holds is the row's difference
 * between its sides where it ends, less that where it begins. Returns 1 where memory lacks. */
#define INTEGRAL(name, number, LANES)                                                                                 \
    typedef number name##_t __attribute__((vector_size(LANES * sizeof(number))));                                     \
    static int name(const region *g, const reference *r, int part, int begin, int k, int32_t *counts) {               \
        size_t n_vectors = (size_t)g->w + 1 + r->joints + g->n;                                                       \
        name##_t *sums = aligned_alloc(64, (sizeof(name##_t) * n_vectors + 63) / 64 * 64);                            \
        if (!sums) return 1;                                                                                          \
        name##_t *marks = sums + g->w + 1, *found = marks + r->joints;                                                \
        memset(sums, 0, sizeof(name##_t) * n_vectors);                                                                \
        const uint16_t *table = r->table + (size_t)part * r->joints * r->channels;                                    \
        for (int i = 0; i < r->joints * r->channels; i++)                                                             \
            if (table[i] >= begin && table[i] < begin + k) marks[i / r->channels][table[i] - begin] = 1;              \
        for (int y = 0; y <= g->h; y++) {                                                                             \
            for (int e = g->rows[y]; e < g->rows[y + 1]; e++) {                                                       \
                int box = g->events[e] / 2;                                                                           \
                name##_t above = sums[g->sides[2 * box + 1]] - sums[g->sides[2 * box]];                               \
                found[box] += g->events[e] % 2 ? above : -above;                                                      \
            }                                                                                                         \
            if (y == g->h) break;                                                                                     \
            /* I(y + 1, x + 1) = I(y, x + 1) + the marks of row y up to x */                                          \
            const uint16_t *joint = g->joint + (size_t)y * g->w;                                                      \
            name##_t run = {0};                                                                                       \
            for (int x = 0; x < g->w; x++) {                                                                          \
                run += marks[joint[x]];                                                                               \
                sums[x + 1] += run;                                                                                   \
            }                                                                                                         \
        }                                                                                                             \
        for (int i = 0; i < g->n; i++) {                                                                              \
            const number *restrict from = (const number *)(found + i);                                                \
            int32_t *restrict to = counts + (size_t)i * r->codes + begin;                                             \
            for (int c = 0; c < k; c++) to[c] = from[c];                                                              \
        }                                                                                                             \
        free(sums);                                                                                                   \
        return 0;                                                                                                     \
    }

INTEGRAL(bytes_16, uint8_t, 16)
INTEGRAL(bytes_32, uint8_t, 32)
INTEGRAL(bytes_64, uint8_t, 64)
INTEGRAL(shorts_8, uint16_t, 8)
INTEGRAL(shorts_16, uint16_t, 16)
INTEGRAL(shorts_32, uint16_t, 32)
INTEGRAL(words_16, uint32_t, 16)

/* All codes of a part, as many at once as fill a cache line. */
static int integrals(const region *g, const reference *r, int part, int largest, int32_t *counts) {
    const int most = largest < 256 ? 64 : largest < 65536 ? 32 : 16;
    for (int begin = r->first[part]; begin < r->first[part + 1]; begin += most) {
        int left = r->first[part + 1] - begin, k = left < most ? left : most;
        int failed = (most == 64   ? k <= 16 ? bytes_16 : k <= 32 ? bytes_32 : bytes_64
                      : most == 32 ? k <= 8 ? shorts_8 : k <= 16 ? shorts_16 : shorts_32
                                   : words_16)(g, r, part, begin, k, counts);
        if (failed) return 1;
    }
    return 0;
}

/* One part of all boxes: `joint` has w columns, from `top` and `left` of the picture on. */
static int count_part(const uint16_t *joint, int w, int top, int left, const reference *r, int part, const int *cells,
                      int n, int32_t *counts) {
    const int step = 3 + r->parts;
    int first = INT32_MAX, last = 0, largest = 0;
    for (int i = 0; i < n; i++) {
        const int *box = cells + i * step;
        int area = (box[1] - box[0]) * (box[3 + part] - box[2 + part]);
        if (area <= 0) continue;
        largest = area > largest ? area : largest;
        first = box[2 + part] < first ? box[2 + part] : first;
        last = box[3 + part] > last ? box[3 + part] : last;
    }
    if (!largest) return 0;
    int h = last - first, *sides = calloc((size_t)4 * n + 2 * (h + 2), sizeof(int));
    if (!sides) return 1;
    int *events = sides + 2 * n, *rows = events + 2 * n, *next = rows + h + 2;
    /* the events in the order of their rows: counted first, then put in their places */
    for (int placing = 0; placing < 2; placing++) {
        for (int i = 0; i < n; i++) {
            const int *box = cells + i * step;
            if (box[1] <= box[0] || box[3 + part] <= box[2 + part]) continue;
            sides[2 * i] = box[0] - left, sides[2 * i + 1] = box[1] - left;
            for (int end = 0; end < 2; end++) {
                int row = box[2 + part + end] - first;
                if (placing)
                    events[next[row]++] = 2 * i + end;
                else
                    rows[row + 1]++;
            }
        }
        for (int y = 0; !placing && y <= h; y++) rows[y + 1] += rows[y];
        memcpy(next, rows, sizeof(int) * (h + 2));
    }
    region g = {joint + (size_t)(first - top) * w, h, w, n, sides, events, rows};
    int failed = integrals(&g, r, part, largest, counts);
    free(sides);
    return failed;
}

static void visit(const picture *p, const reference *r, int part, int x, int y, int32_t *count) {
    uint16_t joint;
    index_row(p, p->pixels + y * p->stride + 3 * x, 1, &joint);
    const uint16_t *table = r->table + ((size_t)part * r->joints + joint) * r->channels;
    for (int channel = 0; channel < r->channels; channel++)
        if (table[channel] < r->codes) count[table[channel]]++;
}

static void count_samples(const picture *p, const reference *r, const sampling *s, const double *boxes, int n,
                          int32_t *counts, int32_t *pixels) {
    for (int i = 0; i < n; i++) {
        const double *box = boxes + 4 * i;
        for (int row = 0; row < s->rows; row++) {
            double y = floor(s->y[row] * (box[3] - box[1]) + box[1]);
            if (!(y >= 0 && y < p->height)) continue;
            for (int column = 0; column < s->columns; column++) {
                double x = floor(s->x[column] * (box[2] - box[0]) + box[0]);
                if (!(x >= 0 && x < p->width)) continue;
                pixels[i * r->parts + s->part[row]]++;
                visit(p, r, s->part[row], (int)x, (int)y, counts + (size_t)i * r->codes);
            }
        }
    }
}

/* Every pixel of each part, from integral images or one box after the other. Returns 1 where memory lacks. */
static int count_pixels(const picture *p, const reference *r, const double *boxes, int n, int32_t *counts,
                        int32_t *pixels) {
    const int step = 3 + r->parts;
    int *cells = malloc(sizeof(int) * (size_t)n * step);
    if (!cells) return 1;
    int left = p->width, right = 0, top = p->height, bottom = 0, failed = 0;
    double touched = 0;
    for (int i = 0; i < n; i++) {
        int *box = cells + i * step, area = 0;
        cells_of(p, r, boxes + 4 * i, box);
        for (int part = 0; part < r->parts; part++)
            area += pixels[i * r->parts + part] = (box[1] - box[0]) * (box[3 + part] - box[2 + part]);
        if (!area) continue;
        touched += area;
        left = box[0] < left ? box[0] : left;
        right = box[1] > right ? box[1] : right;
        top = box[2] < top ? box[2] : top;
        bottom = box[2 + r->parts] > bottom ? box[2 + r->parts] : bottom;
    }
    double h = bottom - top, w = right - left;
    if (touched > 0 && touched * r->channels < DIRECT * h * w * ((r->codes + 31) / 32)) {
        for (int i = 0; i < n; i++)
            for (int part = 0; part < r->parts; part++)
                for (int y = cells[i * step + 2 + part]; y < cells[i * step + 3 + part]; y++)
                    for (int x = cells[i * step]; x < cells[i * step + 1]; x++)
                        visit(p, r, part, x, y, counts + (size_t)i * r->codes);
    } else if (touched > 0) {
        uint16_t *joint = malloc(sizeof(uint16_t) * (size_t)(h * w)), *next = joint;
        failed = !joint;
        for (int y = top; joint && y < bottom; y++, next += right - left)
            index_row(p, p->pixels + y * p->stride + 3 * (int64_t)left, right - left, next);
        for (int part = 0; !failed && part < r->parts; part++)
            failed = count_part(joint, right - left, top, left, r, part, cells, n, counts);
        free(joint);
    }
    free(cells);
    return failed;
}

/* Counts (n, codes) and pixels (n, parts), both zero before, and the distance (n) of each box to the reference,
 * 1 - (the sum over the parts of the sum of scale * root of the count, by the root of the part's pixels) by the most
 * that the parts in the picture can contribute. Returns 1 where memory lacks. */
int dcpf_count(const picture *p, const reference *r, const sampling *s, const double *boxes, int32_t n,
               double *distances, int32_t *counts, int32_t *pixels) {
    if (s->rows)
        count_samples(p, r, s, boxes, n, counts, pixels);
    else if (count_pixels(p, r, boxes, n, counts, pixels))
        return 1;
    for (int i = 0; i < n; i++) {
        double coefficient = 0, most = 0;
        for (int part = 0; part < r->parts; part++) {
            const int32_t *count = counts + (size_t)i * r->codes;
            int in_part = pixels[i * r->parts + part];
            if (!in_part) continue;
            double sum = 0;
            if (in_part < r->known_roots)
                for (int c = r->first[part]; c < r->first[part + 1]; c++) sum += r->scale[c] * r->roots[count[c]];
            else
                for (int c = r->first[part]; c < r->first[part + 1]; c++) sum += r->scale[c] * sqrt(count[c]);
            coefficient += sum / sqrt(in_part);
            most += r->perfect[part];
        }
        distances[i] = most > 0 ? 1 - coefficient / most : 1;
    }
    return 0;
}
