/* Which nodes of the ice melt in a stage: a guess from what friction makes before it (see
 * `ice_surface.py`).
 */

/* How closely (K) a guess is found, and in how many iterations: it may be left as it is. */
#define CLOSE 1e-4
#define GUESS_ITERATIONS 12
#define GUESS_LINEAR_ITERATIONS 30
/* How often points share out what a node takes, the share of weights between nodes that melt (1,
 * but for rounding), and of the area around a node that melts at least. */
#define FILLINGS 3
#define BETWEEN 0.999
#define LEAST_MELTING 0.1

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
            const double room = larger(melting_around[i], LEAST_MELTING * area[i]);
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
    if (limited(surface, power, most, rise, heat, held, work))
        flux_of_melting(surface, powers, areas, area, heat, held, flux, at_points, work);
    for (int i = 0; i < n; i++)
        temperature[i] =
            held[i] ? melting_temperature - link * flux[i] : surface->offset[i] + rise[i];
    free(room);
    return 0;
}
