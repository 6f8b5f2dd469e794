/* print_tables.c - prints what a step, an update of chunks and a combination run, as their tables say (runtime/entries.h), for
   docs/architecture.md. */
#define SPRINGLS_IMPLEMENTATION
#include "springls.h"

#include <stdio.h>

enum { MAX_TABLES = 64 };
static const springls__entry *tables[MAX_TABLES];
static const char *table_names[MAX_TABLES];
static int table_count;

/* Prints a name, or several, without the prefixes of the library. */
static void print_names(const char *names)
{
    static const char *const prefixes[] = { "springls__", "ARRAY_", "ROLE_" };
    while (*names) {
        size_t i, skipped = 0;
        for (i = 0; i < sizeof prefixes / sizeof *prefixes; i++)
            if (strncmp(names, prefixes[i], strlen(prefixes[i])) == 0) skipped = strlen(prefixes[i]);
        names += skipped;
        if (!skipped) putchar(*names++);
    }
}

/* Lists a table that is to be printed, once. */
static void list(const char *name, const springls__entry *table)
{
    int i;
    for (i = 0; i < table_count; i++)
        if (tables[i] == table) return;
    if (table_count == MAX_TABLES) exit(2);
    table_names[table_count] = name;
    tables[table_count++] = table;
}

/* Prints an entry other than the end of a block. */
static void print_entry(const springls__entry *entry)
{
    static const char *const verb[] = { "", "kernel ", "", "swap ", "", "if ", "while ", "" };
    static const char *const over[] = { "springls", "bricks", "slots" };
    const bool stage = entry->kind == SPRINGLS__ENTRY_CALL && entry->what >= 0;
    fputs(stage ? "stage " : entry->kind == SPRINGLS__ENTRY_CALL ? "call " : verb[entry->kind], stdout);
    print_names(entry->name);
    if (entry->kind == SPRINGLS__ENTRY_KERNEL) printf(" over %s", over[entry->other]);
    putchar('\n');
}

static void print_table(const char *name, const springls__entry *entry)
{
    int depth = 1;
    fputs("\n    ", stdout);
    print_names(name);
    putchar('\n');
    for (;; entry++) {
        if (entry->kind == SPRINGLS__ENTRY_END && --depth == 0) return;
        if (entry->kind == SPRINGLS__ENTRY_END || entry->kind == SPRINGLS__ENTRY_ROOM) continue;
        printf("    %*s", 4 * depth, "");
        print_entry(entry);
        if (entry->kind == SPRINGLS__ENTRY_IF || entry->kind == SPRINGLS__ENTRY_REPEAT_WHILE) depth++;
        if (entry->kind == SPRINGLS__ENTRY_CALL) list(entry->name, entry->table);
    }
}

int main(void)
{
    int i;
    list("step", springls__step);
    list("chunks_update", springls__chunks_update);
    list("combine", springls__combine);
    for (i = 0; i < table_count; i++) print_table(table_names[i], tables[i]);
    putchar('\n');
    return ferror(stdout) || fflush(stdout) != 0;
}
