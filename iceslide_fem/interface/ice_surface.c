/* The surface of ice within an implicit stage, and the points of all ranks that give heat to it:
 * what `ice_surface` says, for arrays of a few hundred nodes and a few thousand points, which it is
 * gone through too often for calls of NumPy.
 *
 * Values of nodes are (nx, ny), y innermost and 1 in a slice; matrices are as C has them.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* BLAS and LAPACK, as SciPy has them (see `lapack`). */
typedef void Product(const char *, const char *, const int *, const int *, const int *,
                     const double *, const double *, const int *, const double *, const int *,
                     const double *, double *, const int *);
typedef void Factorise(const char *, const int *, const int *, double *, const int *, int *);
typedef void SolveFactored(const char *, const int *, const int *, const int *, const double *,
                           const int *, double *, const int *, int *);
static Product *dgemm;
static Factorise *dpbtrf;
static SolveFactored *dpbtrs;

void lapack(void *product, void *factorise, void *solve)
{
    dgemm = (Product *)product;
    dpbtrf = (Factorise *)factorise;
    dpbtrs = (SolveFactored *)solve;
}

/* How closely (K) a guess is found, and in how many iterations: it may be left as it is. */
#define CLOSE 1e-4
#define GUESS_ITERATIONS 12
#define GUESS_LINEAR_ITERATIONS 30
/* How often points share out what a node takes, the share of weights between nodes that melt (1,
 * but for rounding), and of the area around a node that melts at least. */
#define FILLINGS 3
#define BETWEEN 0.999
#define LEAST_MELTING 0.1
/* Conjugate gradients for a change of the temperatures. */
#define LINEAR_TOLERANCE 1e-3
#define LINEAR_ITERATIONS 500
/* A line search: the share of the first slope that may be left of it, uphill; trials. */
#define ENOUGH 0.1
#define SEARCH_TRIALS 12
/* Neighbours of a node in a cell: how far apart the numbers of a cell's nodes may be. */
#define DIAGONALS 5

static double largest(int n, const double *x)
{
    double most = 0.0;
    for (int i = 0; i < n; i++) {
        if (!isfinite(x[i]))
            return x[i];
        most = fmax(most, fabs(x[i]));
    }
    return most;
}

static double dot(int n, const double *x, const double *y)
{
    double sum = 0.0;
    for (int i = 0; i < n; i++)
        sum += x[i] * y[i];
    return sum;
}

static void add(int n, double share, const double *x, double *y)
{
    for (int i = 0; i < n; i++)
        y[i] += share * x[i];
}

/* ---- Points on the grid: bilinear, and with the same weights back. ---- */

static void interpolate(const Points *points, const double *nodes, double *values)
{
    for (int p = 0, i = 0; p < points->n; p++) {
        double sum = 0.0;
        for (int corner = 0; corner < points->corners; corner++, i++)
            sum += points->share[i] * nodes[points->node[i]];
        values[p] = sum;
    }
}

static void scatter(const Surface *surface, const double *amounts, double *nodes)
{
    const Points *points = surface->points;
    memset(nodes, 0, (size_t)surface->n * sizeof *nodes);
    for (int p = 0, i = 0; p < points->n; p++)
        for (int corner = 0; corner < points->corners; corner++, i++)
            nodes[points->node[i]] += points->share[i] * amounts[p];
}

/* How far apart the numbers of a cell's nodes are: the diagonals of what couples them. */
static int diagonals(int ny, int *apart)
{
    const int all[DIAGONALS] = {0, 1, ny - 1, ny, ny + 1};
    const int count = ny == 1 ? 2 : DIAGONALS;
    memcpy(apart, all, (size_t)count * sizeof *apart);
    return count;
}

/* Sum over the points of conductance * N N^T, by diagonals; whether it is anything. */
static int coupling(const Surface *surface, const double *conductance, double *bands)
{
    const Points *points = surface->points;
    const int n = surface->n, corners = points->corners;
    const int number[4] = {0, 1, surface->ny, surface->ny + 1};
    int apart[DIAGONALS], band[4][4], any = 0;
    const int count = diagonals(surface->ny, apart);
    for (int one = 0; one < corners; one++)
        for (int other = one; other < corners; other++)
            for (int d = 0; d < count; d++)
                if (apart[d] == number[other] - number[one])
                    band[one][other] = d * n;
    memset(bands, 0, (size_t)(count * n) * sizeof *bands);
    for (int p = 0; p < points->n; p++) {
        if (conductance[p] == 0.0)
            continue;
        const double *share = points->share + p * corners;
        const int *node = points->node + p * corners;
        any = 1;
        for (int one = 0; one < corners; one++) {
            const double half = conductance[p] * share[one];
            for (int other = one; other < corners; other++)
                bands[band[one][other] + node[one]] += half * share[other];
        }
    }
    return any;
}

/* ---- The ice below: diagonal in the lateral modes, or column by column. ---- */

/* out (rows, columns) = a b, each as it is ('N') or transposed ('T'), of `inner` terms. */
static void product(char a_as, char b_as, int rows, int columns, int inner, const double *a,
                    const double *b, double *out)
{
    const double one = 1.0, zero = 0.0;
    const int a_width = a_as == 'N' ? inner : rows, b_width = b_as == 'N' ? columns : inner;
    dgemm(&b_as, &a_as, &columns, &rows, &inner, &one, b, &b_width, a, &a_width, &zero, out,
          &columns); /* BLAS counts columns first: it finds the transposed product */
}

/* X a Y^T, or X^T a Y if `transposed`, with a matrix for each line. */
static void along_lines(const Surface *surface, const double *x, const double *y, int transposed,
                        const double *a, double *out)
{
    const int nx = surface->nx, ny = surface->ny;
    const double *rows = a;
    if (ny > 1) {
        product('N', transposed ? 'N' : 'T', nx, ny, ny, a, y, surface->scratch);
        rows = surface->scratch;
    }
    product(transposed ? 'T' : 'N', 'N', nx, ny, nx, x, rows, out);
}

/* What the ice takes (W) where its surface is by `rise` (K) above the offset. */
static void taken(const Surface *surface, const double *rise, double *out)
{
    if (!surface->x_inverse) {
        for (int i = 0; i < surface->n; i++)
            out[i] = surface->cell_area[i] / surface->resistance[i] * rise[i];
        return;
    }
    double *amplitudes = surface->scratch + surface->n;
    along_lines(surface, surface->x_inverse, surface->y_inverse, 0, rise, amplitudes);
    for (int i = 0; i < surface->n; i++)
        amplitudes[i] /= surface->resistance[i];
    along_lines(surface, surface->x_inverse, surface->y_inverse, 1, amplitudes, out);
}

/* How far (K) the surface is above the offset where the ice takes the `heat` (W). */
static void warmed(const Surface *surface, const double *heat, double *out)
{
    if (!surface->x_vectors) {
        for (int i = 0; i < surface->n; i++)
            out[i] = surface->resistance[i] / surface->cell_area[i] * heat[i];
        return;
    }
    double *amplitudes = surface->scratch + surface->n;
    along_lines(surface, surface->x_vectors, surface->y_vectors, 1, heat, amplitudes);
    for (int i = 0; i < surface->n; i++)
        amplitudes[i] *= surface->resistance[i];
    along_lines(surface, surface->x_vectors, surface->y_vectors, 0, amplitudes, out);
}

static double most_resistance(const Surface *surface, double *least)
{
    double most = *least = surface->resistance[0];
    for (int i = 1; i < surface->n; i++) {
        most = fmax(most, surface->resistance[i]);
        *least = fmin(*least, surface->resistance[i]);
    }
    return most;
}

/* ---- Conjugate gradients, preconditioned. ---- */

/* A symmetric system: what x loads (out), what answers a load (out), whether that is close. */
typedef struct Linear {
    const Surface *surface;
    void (*load)(const struct Linear *, const double *x, double *out);
    int (*answered)(const struct Linear *, const double *load, double *out);
    int (*close)(const struct Linear *, const double *answer, double share);
    const double *bands, *factor, *per_heat; /* what these need */
    double small;
    int iterations, width, band_count;
    int apart[DIAGONALS];
} Linear;

/* x with load(x) = left, and what is left of it; whether that is close. work: (3, n).
 * `answered` may be blind to some of it: there x stays zero, and something is left. */
static int conjugate_gradients(const Linear *linear, double *x, double *left, double *work)
{
    const int n = linear->surface->n;
    double *direction = work, *answer = work + n, *against = work + 2 * n;
    memset(x, 0, (size_t)n * sizeof *x);
    if (!linear->answered(linear, left, answer))
        return 0;
    memcpy(direction, answer, (size_t)n * sizeof *answer);
    double size = dot(n, left, answer);
    const double first = size;
    for (int iteration = 0; iteration < linear->iterations; iteration++) {
        if (linear->close(linear, answer, first != 0.0 ? size / first : 0.0))
            return 1;
        linear->load(linear, direction, against);
        const double length = size / dot(n, direction, against);
        add(n, length, direction, x);
        add(n, -length, against, left);
        if (!linear->answered(linear, left, answer))
            return 0;
        const double before = size;
        size = dot(n, left, answer);
        for (int i = 0; i < n; i++)
            direction[i] = answer[i] + size / before * direction[i];
    }
    return 0;
}

/* ---- A guess of what melts (see `ice_surface`). ---- */

static void ice_load(const Linear *linear, const double *x, double *out)
{
    taken(linear->surface, x, out);
}

static int by_area(const Linear *linear, const double *load, double *out)
{
    for (int i = 0; i < linear->surface->n; i++)
        out[i] = linear->per_heat[i] * load[i];
    return 1;
}

static int nearly(const Linear *linear, const double *answer, double share)
{
    (void)share;
    return !(largest(linear->surface->n, answer) > linear->small);
}

/* Rise (K) of nodes that take the `power` (W) but where they are `held` at what `rise` is now, and
 * the heat (W) that all take. In short stages, in which heat does not get far along the surface,
 * all modes conduct nearly the same, and the cells' areas precondition them. */
static void beside(const Surface *surface, const char *held, const double *power, double *rise,
                   double *heat, double *work)
{
    const int n = surface->n;
    double *per_heat = work, *more = work + n, *left = work + 2 * n, least;
    if (!memchr(held, 1, (size_t)n)) {
        warmed(surface, power, rise);
        memcpy(heat, power, (size_t)n * sizeof *heat);
        return;
    }
    for (int i = 0; i < n; i++)
        per_heat[i] = held[i] ? 0.0 : 1.0 / surface->cell_area[i];
    taken(surface, rise, left);
    for (int i = 0; i < n; i++)
        left[i] = power[i] - left[i];
    const Linear linear = {.surface = surface, .load = ice_load, .answered = by_area,
                           .close = nearly, .per_heat = per_heat,
                           .small = CLOSE / most_resistance(surface, &least),
                           .iterations = GUESS_LINEAR_ITERATIONS};
    conjugate_gradients(&linear, more, left, work + 3 * n);
    add(n, 1.0, more, rise);
    for (int i = 0; i < n; i++)
        heat[i] = power[i] - left[i];
}

/* Rise (K) of the nodes from that before the stage, what they take (W), and which of them are held
 * at `most`. A primal-dual active set (Hintermueller, Ito, Kunisch, SIAM J. Optim. 13 (2002) 865),
 * from the nodes that were within CLOSE of it; whether any is held. */
static int limited(const Surface *surface, const double *power, const double *most, double *rise,
                   double *heat, char *held, double *work)
{
    const int n = surface->n;
    for (int i = 0; i < n; i++)
        held[i] = power[i] > 0.0 && rise[i] >= most[i] - CLOSE;
    for (int iteration = 0, changes = 1; changes && iteration < GUESS_ITERATIONS; iteration++) {
        for (int i = 0; i < n; i++)
            if (held[i])
                rise[i] = most[i];
        beside(surface, held, power, rise, heat, work);
        changes = 0;
        for (int i = 0; i < n; i++) {
            const int change =
                held[i] ? heat[i] > power[i] : power[i] > 0.0 && rise[i] > most[i] + CLOSE;
            held[i] ^= (char)change;
            changes |= change;
        }
    }
    return memchr(held, 1, (size_t)n) != NULL;
}

/* Flux (W/m2) that melting points give around nodes that are `held` and take the `heat` (W).
 * Points between such nodes melt, but for those whose friction makes less than the flux: they give
 * all of it, as the others do, and what then is missing those that melt give.
 * powers: of the points, W; areas: of them, m2; area: of all points around the nodes, m2. */
static void flux_of_melting(const Surface *surface, const double *powers, const double *areas,
                            const double *area, const double *heat, const char *held,
                            double *flux, double *at_points, double *work)
{
    const int n = surface->n, m = surface->points->n;
    double *between = at_points, *given = at_points + m, *melting = at_points + 2 * m;
    double *given_around = work, *melting_around = work + n, *is_held = work + 2 * n;
    for (int i = 0; i < n; i++)
        is_held[i] = held[i];
    interpolate(surface->points, is_held, between);
    memset(flux, 0, (size_t)n * sizeof *flux);
    for (int filling = 0; filling < FILLINGS; filling++) {
        interpolate(surface->points, flux, given);
        for (int p = 0; p < m; p++) {
            const double molten = areas[p] * given[p];
            const int melts = between[p] > BETWEEN && molten < powers[p];
            given[p] = melts ? molten : powers[p];
            melting[p] = melts ? areas[p] : 0.0;
        }
        scatter(surface, given, given_around);
        scatter(surface, melting, melting_around);
        for (int i = 0; i < n; i++) {
            const double room = fmax(melting_around[i], LEAST_MELTING * area[i]);
            if (held[i] && room > 0.0)
                flux[i] += (heat[i] - given_around[i]) / room;
        }
    }
}

/* Temperature (K) of the nodes at the end of a stage, from that before it, which it replaces.
 * powers, areas: of the friction at the points before the stage (W), and of them (m2). -1 where
 * there is no memory. */
int melting_guess(Surface *surface, const double *powers, const double *areas, double link,
                  double melting_temperature, double *temperature)
{
    const int n = surface->n, m = surface->points->n;
    double *room = malloc((14 * (size_t)n + 3 * (size_t)m) * sizeof *room + (size_t)n);
    if (!room)
        return -1;
    double *power = room, *area = room + n, *most = room + 2 * n, *rise = room + 3 * n;
    double *heat = room + 4 * n, *flux = room + 5 * n, *work = room + 6 * n;
    surface->scratch = room + 12 * n;
    double *at_points = room + 14 * n;
    char *held = (char *)(at_points + 3 * m);
    scatter(surface, powers, power);
    scatter(surface, areas, area);
    for (int i = 0; i < n; i++) {
        most[i] = melting_temperature - surface->offset[i];
        rise[i] = temperature[i] - surface->offset[i];
    }
    if (limited(surface, power, most, rise, heat, held, work)) {
        for (int i = 0; i < n; i++)
            heat[i] = held[i] ? heat[i] : 0.0;
        flux_of_melting(surface, powers, areas, area, heat, held, flux, at_points, work);
        for (int i = 0; i < n; i++)
            temperature[i] = held[i] ? melting_temperature - link * flux[i]
                                     : surface->offset[i] + rise[i];
    } else {
        for (int i = 0; i < n; i++)
            temperature[i] = surface->offset[i] + rise[i];
    }
    free(room);
    return 0;
}

/* ---- The balance of ice and points (see `ice_surface`). ---- */

/* Heat (W) that a point gives where it is by `rise` (K) warmer than when it was asked. */
static double heat_of(const Fluxes *flux, double rise)
{
    return fmin(flux->heat - flux->fall * rise, flux->other_heat - flux->other_fall * rise);
}

/* How it falls with the temperature there, W/K. */
static double fall_of(const Fluxes *flux, double rise)
{
    const double one = flux->heat - flux->fall * rise;
    return flux->other_heat - flux->other_fall * rise < one ? flux->other_fall : flux->fall;
}

static void load_with_points(const Linear *linear, const double *x, double *out)
{
    const int n = linear->surface->n;
    taken(linear->surface, x, out);
    for (int i = 0; i < n; i++)
        out[i] += linear->bands[i] * x[i];
    for (int d = 1; d < linear->band_count; d++) {
        const double *band = linear->bands + d * n;
        const int apart = linear->apart[d];
        for (int i = 0; i + apart < n; i++) {
            out[i + apart] += band[i] * x[i];
            out[i] += band[i] * x[i + apart];
        }
    }
}

static int by_bands(const Linear *linear, const double *load, double *out)
{
    const int n = linear->surface->n, one = 1, height = linear->width + 1;
    int fault;
    memcpy(out, load, (size_t)n * sizeof *out);
    dpbtrs("L", &n, &linear->width, &one, linear->factor, &height, out, &n, &fault);
    return fault == 0;
}

static int shrunk(const Linear *linear, const double *answer, double share)
{
    (void)linear, (void)answer;
    return !(share > LINEAR_TOLERANCE * LINEAR_TOLERANCE);
}

/* Solve (conduction + the points' conductance) x = left (W) for temperatures x, K; 0 if it fails.
 * Preconditioned by the points' `bands` with the conduction of a mode in the middle: in short
 * stages all modes have nearly the same. factor: room for its bands. */
static int correction(const Surface *surface, const double *bands, double *factor, double *x,
                      double *left, double *work)
{
    Linear linear = {.surface = surface, .load = load_with_points, .answered = by_bands,
                     .close = shrunk, .bands = bands, .factor = factor,
                     .iterations = LINEAR_ITERATIONS};
    const int n = surface->n;
    linear.band_count = diagonals(surface->ny, linear.apart);
    linear.width = linear.apart[linear.band_count - 1];
    const int height = linear.width + 1;
    double least;
    const double most = most_resistance(surface, &least), middle = sqrt(most * least);
    int fault;
    memset(factor, 0, (size_t)n * (size_t)height * sizeof *factor);
    for (int d = 0; d < linear.band_count; d++)
        for (int i = 0; i < n; i++)
            factor[(size_t)i * (size_t)height + (size_t)linear.apart[d]] += bands[d * n + i];
    for (int i = 0; i < n; i++)
        factor[(size_t)i * (size_t)height] += surface->cell_area[i] / middle;
    dpbtrf("L", &n, &linear.width, factor, &height, &fault);
    return fault == 0 && conjugate_gradients(&linear, x, left, work);
}

/* The share of a change with which the minimum along it is near enough: where a full one has gone
 * well past it (points that melted do so no longer, and the next would undo it), the share at which
 * the slope is about zero, by false position (Illinois). `first`: the slope at its start, < 0;
 * without the points it is `alone` there and grows by `curvature`. moved: change (K) of the points
 * whose rise is `rise`. */
static double search(int m, const Fluxes *fluxes, const double *rise, const double *moved,
                     double alone, double curvature, double first)
{
    double share = 1.0, low = 0.0, slope_low = first, high = 1.0, slope_high = 0.0;
    for (int trial = 0; trial <= SEARCH_TRIALS; trial++) {
        double slope = alone + share * curvature;
        for (int p = 0; p < m; p++)
            slope -= moved[p] * heat_of(fluxes + p, rise[p] + share * moved[p]);
        if ((trial == 0 ? slope : fabs(slope)) <= -ENOUGH * first)
            break;
        if (trial == 0) {
            slope_high = slope;
        } else if (slope > 0.0) {
            high = share, slope_high = slope, slope_low *= 0.5;
        } else {
            low = share, slope_low = slope, slope_high *= 0.5;
        }
        if (trial < SEARCH_TRIALS)
            share = low - slope_low * (high - low) / (slope_high - slope_low);
    }
    return share;
}

/* Bring the temperatures (K) of the nodes, at which the points were asked for their fluxes, to
 * where what is given and taken balances. given (n): what points give to the nodes there, W;
 * changes: of the temperatures. Newton's method with a line search. */
int balance(Surface *surface, const Fluxes *fluxes, double agreement, double within,
            int iterations, double *temperature, double *given, int *changes)
{
    const int n = surface->n, m = surface->points->n;
    const int height = surface->ny + 2;
    const size_t nodes = (size_t)(11 + DIAGONALS + height) * (size_t)n;
    double *room = malloc((nodes + 4 * (size_t)m) * sizeof *room);
    if (!room)
        return FAILED;
    double *all = room, *imbalance = room + n, *residual = room + 2 * n, *change = room + 3 * n;
    double *more = room + 4 * n, *left = room + 5 * n, *work = room + 6 * n;
    surface->scratch = room + 9 * n;
    double *bands = room + 11 * n, *factor = bands + DIAGONALS * n;
    double *rise = room + nodes, *moved = rise + m, *amounts = rise + 2 * m;
    double *falls = rise + 3 * m;
    int outcome = UNSETTLED, depends = 0;
    double off, target = agreement;
    *changes = 0;
    for (int i = 0; i < n; i++)
        change[i] = temperature[i] - surface->offset[i];
    taken(surface, change, all);
    for (int p = 0; p < m; p++) {
        rise[p] = 0.0;
        falls[p] = fluxes[p].fall;
        amounts[p] = fluxes[p].heat;
    }
    for (int iteration = 0; iteration < iterations; iteration++) {
        scatter(surface, amounts, given);
        for (int i = 0; i < n; i++)
            imbalance[i] = all[i] - given[i];
        warmed(surface, imbalance, residual);
        off = largest(n, residual);
        if (off <= target) {
            outcome = *changes == 0 ? SETTLED : depends ? CHANGED : FOUND;
            break;
        }
        if (!isfinite(off))
            break;
        target = within;
        if (coupling(surface, falls, bands)) {
            depends = 1;
            memcpy(left, imbalance, (size_t)n * sizeof *left);
            if (!correction(surface, bands, factor, change, left, work)) {
                outcome = FAILED;
                break;
            }
        } else {
            memcpy(change, residual, (size_t)n * sizeof *change);
        }
        for (int i = 0; i < n; i++)
            change[i] = -change[i];
        interpolate(surface->points, change, moved);
        taken(surface, change, more);
        const double share = search(m, fluxes, rise, moved, dot(n, change, all),
                                    dot(n, change, more), dot(n, change, imbalance));
        add(n, share, change, temperature);
        add(n, share, more, all);
        for (int p = 0; p < m; p++) {
            rise[p] += share * moved[p];
            amounts[p] = heat_of(fluxes + p, rise[p]);
            falls[p] = fall_of(fluxes + p, rise[p]);
        }
        ++*changes;
    }
    free(room);
    return outcome;
}
