/* MUMPS by its own interface (MUMPS 5.5 Users' guide, ch. 5): PETSc before 3.25 has it only in the
 * precision of its own numbers.
 */
#include <smumps_c.h>
#include <stdlib.h>

#define ICNTL(I) icntl[(I)-1] /* as numbered in the guide */

enum { BEGIN = -1, END = -2, ANALYSE = 1, FACTORISE = 2, SOLVE = 3 };

static int run(SMUMPS_STRUC_C *factors, int job)
{
    factors->job = job;
    smumps_c(factors);
    return factors->infog[0] < 0 ? factors->infog[0] : 0; /* positive: a warning */
}

void *begin(int communicator)
{
    SMUMPS_STRUC_C *factors = calloc(1, sizeof *factors);
    if (!factors)
        return NULL;
    factors->comm_fortran = communicator;
    factors->par = 1; /* the first rank takes part */
    factors->sym = 0; /* the shear of friction is not symmetric */
    run(factors, BEGIN);
    for (int output = 1; output <= 3; ++output)
        factors->ICNTL(output) = -1;
    factors->ICNTL(4) = 0;
    factors->ICNTL(6) = factors->ICNTL(8) = 0; /* neither columns permuted nor scaling */
    factors->ICNTL(13) = 1;                    /* the last front on one rank */
    factors->ICNTL(18) = 3;                    /* entries on all ranks */
    return factors;
}

int analyse(void *any, int unknowns, long long entries, int *rows, int *columns)
{
    SMUMPS_STRUC_C *factors = any;
    factors->n = unknowns;
    factors->nnz_loc = entries;
    factors->irn_loc = rows;
    factors->jcn_loc = columns;
    return run(factors, ANALYSE);
}

int analyse_inner(void *any, int unknowns, long long entries, int *rows, int *columns,
                  int *order, int left, int *unknowns_left, float *added)
{
    SMUMPS_STRUC_C *factors = any;
    factors->perm_in = order;
    factors->ICNTL(7) = 1; /* that order */
    factors->size_schur = left;
    factors->listvar_schur = unknowns_left;
    factors->schur = added;
    factors->ICNTL(19) = 1;
    return analyse(factors, unknowns, entries, rows, columns);
}

int factorise(void *any, float *values, int room)
{
    SMUMPS_STRUC_C *factors = any;
    factors->a_loc = values;
    factors->ICNTL(14) = room;
    return run(factors, FACTORISE);
}

int replaced(void *any)
{
    SMUMPS_STRUC_C *factors = any;
    return factors->infog[24];
}

static void dense(SMUMPS_STRUC_C *factors, int count, float *whole)
{
    factors->rhs = whole;
    factors->nrhs = count;
    factors->lrhs = factors->n;
    factors->ICNTL(20) = 0; /* dense loads */
}

int solve(void *any, float *load)
{
    dense(any, 1, load);
    return run(any, SOLVE);
}

static void give(SMUMPS_STRUC_C *factors, int count, int *first, int *rows, float *values)
{
    factors->nrhs = count;
    factors->nz_rhs = first ? first[count] - 1 : 0;
    factors->irhs_ptr = first;
    factors->irhs_sparse = rows;
    factors->rhs_sparse = values;
    factors->ICNTL(20) = 1; /* sparse loads */
}

int solve_many(void *any, int count, int *first, int *rows, float *values, float *solutions)
{
    SMUMPS_STRUC_C *factors = any;
    give(factors, count, first, rows, values);
    factors->rhs = solutions;
    factors->lrhs = factors->n;
    return run(factors, SOLVE);
}

static int pass(SMUMPS_STRUC_C *factors, int which, float *left)
{
    factors->redrhs = left;
    factors->lredrhs = factors->size_schur;
    factors->ICNTL(26) = which;
    return run(factors, SOLVE);
}

int condense(void *any, float *load, float *condensed)
{
    dense(any, 1, load);
    return pass(any, 1, condensed);
}

int condense_many(void *any, int count, int *first, int *rows, float *values, float *condensed)
{
    give(any, count, first, rows, values);
    return pass(any, 1, condensed);
}

int expand(void *any, int count, float *found, float *solutions)
{
    dense(any, count, solutions);
    return pass(any, 2, found);
}

void end(void *any)
{
    run(any, END);
    free(any);
}
