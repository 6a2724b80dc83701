/* The balance of what the ice takes in a stage and what points give to it (see `ice_surface.py`).
 */

/* Conjugate gradients for a change of the temperatures. */
#define LINEAR_TOLERANCE 1e-3
#define LINEAR_ITERATIONS 500
/* A line search: the share of the first slope that may be left of it, uphill; trials. */
#define ENOUGH 0.1
#define SEARCH_TRIALS 12
/* How far apart the numbers of a cell's nodes may be: so many diagonals couple them. */
#define DIAGONALS 5

/* How far apart they are, and how many diagonals that makes. */
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

/* Heat (W) that a point gives where it is by `rise` (K) warmer than when it was asked. */
static double heat_of(const Fluxes *flux, double rise)
{
    return smaller(flux->heat - flux->fall * rise, flux->other_heat - flux->other_fall * rise);
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
    int apart[DIAGONALS];
    const int n = surface->n, count = diagonals(surface->ny, apart), width = apart[count - 1];
    const int height = width + 1;
    const Linear linear = {.surface = surface, .load = load_with_points, .answered = by_bands,
                           .close = shrunk, .bands = bands, .factor = factor, .apart = apart,
                           .iterations = LINEAR_ITERATIONS, .width = width, .band_count = count};
    double least;
    const double most = most_resistance(surface, &least), middle = sqrt(most * least);
    int fault;
    memset(factor, 0, (size_t)n * (size_t)height * sizeof *factor);
    for (int d = 0; d < count; d++)
        for (int i = 0; i < n; i++)
            factor[(size_t)i * (size_t)height + (size_t)apart[d]] += bands[d * n + i];
    for (int i = 0; i < n; i++)
        factor[(size_t)i * (size_t)height] += surface->cell_area[i] / middle;
    dpbtrf("L", &n, &width, factor, &height, &fault);
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
            outcome = depends ? DEPENDS : FOUND;
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
